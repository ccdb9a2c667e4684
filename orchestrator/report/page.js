"use strict";
// the slider: the grains at the end of each load step
for (const box of document.querySelectorAll("[data-steps]")) {
  const data = JSON.parse(document.getElementById(box.dataset.steps).textContent);
  const slider = box.querySelector("input");
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
    const model = data.model ? ` ${data.names[0]} (${data.names[1]} ${data.model[step]})` : "";
    box.querySelector("output").innerHTML = `${data.flow[step]} ${data.unit}${model}: ${n} of ${N} entrained `
      + `(${Math.round(100 * n / N)} %)`;
  };
  slider.addEventListener("input", () => show(+slider.value));
}
