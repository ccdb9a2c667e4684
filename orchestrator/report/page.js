"use strict";
const read = (id) => JSON.parse(document.getElementById(id).textContent);

// a pointer on the diagram: what is nearest says its scene, threshold, doubts and case
for (const box of document.querySelectorAll("[data-points]")) {
  const svg = box.querySelector("svg"), tip = box.querySelector(".tip");
  const points = Object.entries(read(box.dataset.points)).flatMap(([id, said]) =>
    [...document.getElementById(id).querySelectorAll("use")].map((use, i) =>
      ({ x: +use.getAttribute("x"), y: +use.getAttribute("y"), said: said[i] })));
  const distance = (p, at) => Math.hypot(p.x - at.x, p.y - at.y);
  svg.addEventListener("pointermove", (event) => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const near = points.reduce((a, b) => (distance(a, at) < distance(b, at) ? a : b));
    tip.hidden = distance(near, at) > 12;
    if (tip.hidden) return;
    const [scene, threshold, why, name] = near.said;
    tip.replaceChildren(...[scene, threshold, why ? `not usable: ${why}` : "usable", name]
      .filter(Boolean).map((line) => Object.assign(document.createElement("div"), { textContent: line })));
    const place = box.getBoundingClientRect();
    tip.style.left = `${Math.min(event.clientX - place.left + 12, place.width - 300)}px`;
    tip.style.top = `${event.clientY - place.top + 12}px`;
  });
  svg.addEventListener("pointerleave", () => { tip.hidden = true; });
}

// the slider: the grains at the end of each load step
for (const box of document.querySelectorAll("[data-steps]")) {
  const data = read(box.dataset.steps), slider = box.querySelector("input");
  const circles = [...box.querySelectorAll(".grains circle")];
  const under = circles.map((circle) => (circle.dataset.c));
  const show = (step) => {
    const places = data.start.map((place) => [...place]);
    for (const frame of data.frames.slice(0, step))
      for (let k = 0; k < frame.length; k += 3) places[frame[k]] = [frame[k + 1], frame[k + 2]];
    circles.forEach((circle, i) => {
      const gone = places[i][0] === null, [x, y] = gone ? data.start[i] : places[i];
      const moved = data.level[i] > 0 && data.level[i] <= step;
      circle.setAttribute("cx", x);
      circle.setAttribute("cy", y);
      circle.setAttribute("class", moved ? (gone ? "v g" : "v") : under[i]);
    });
    const line = data.lines?.findLast(([first]) => first <= step);
    if (line) box.querySelector(".line").setAttribute("d", line[1]);
    const [n, N] = [data.moved[step], data.count];
    box.querySelector("output").textContent = `${data.step} ${step} of ${data.frames.length}: `
      + `u*₀ = ${data.flow[step]} m/s, n/N = ${n}/${N} = ${Math.round(100 * n / N)} %`;
  };
  slider.addEventListener("input", () => show(+slider.value));
  show(+slider.value);
}

// paper has no folds: captions are printed, and closed again on the screen
const captions = [...document.querySelectorAll("figcaption > details")].map((fold) => [fold, fold.open]);
addEventListener("beforeprint", () => captions.forEach(([fold]) => { fold.open = true; }));
addEventListener("afterprint", () => captions.forEach(([fold, open]) => { fold.open = open; }));
