"use strict";
// the slider: the grains at the end of each load step, one after the other where it plays
const LASTS_MS = 8000, FRAME_MS = 40;
for (const box of document.querySelectorAll("[data-steps]")) {
  const data = JSON.parse(document.getElementById(box.dataset.steps).textContent);
  const slider = box.querySelector("input"), button = box.querySelector(".play");
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
  let playing = 0;
  const stop = () => {
    clearInterval(playing);
    playing = 0;
    button.textContent = "▶ Play";
  };
  const step = Math.max(1, Math.ceil(data.frames.length * FRAME_MS / LASTS_MS));
  const wait = Math.max(FRAME_MS, LASTS_MS / data.frames.length * step);
  button.addEventListener("click", () => {
    if (playing) return stop();
    if (+slider.value >= +slider.max) slider.value = 0;
    button.textContent = "❚❚ Pause";
    playing = setInterval(() => {
      slider.value = +slider.value + step;
      show(+slider.value);
      if (+slider.value >= +slider.max) stop();
    }, wait);
  });
  button.hidden = data.frames.length < 2;
  slider.addEventListener("input", () => { if (playing) stop(); show(+slider.value); });
}

// a figure as PNG, made of the picture on the page
const saved = (name, image, width, height) => {
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d");
  canvas.width = 2000;
  canvas.height = Math.round(2000 * height / width);
  pen.fillStyle = "#fff";
  pen.fillRect(0, 0, canvas.width, canvas.height);
  pen.drawImage(image, 0, 0, canvas.width, canvas.height);
  const link = document.createElement("a");
  link.download = `${name}.png`;
  link.href = canvas.toDataURL("image/png");
  link.click();
};
for (const line of document.querySelectorAll(".files-of:not(:has([href$='.png']))")) {
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = "PNG";
  button.addEventListener("click", () => {
    const figure = line.closest("figure"), drawn = figure.querySelector(".sheet img"), name = line.dataset.name;
    if (drawn) return saved(name, drawn, drawn.naturalWidth, drawn.naturalHeight);
    const svg = figure.querySelector(".sheet svg, .bed-box svg"), { width, height } = svg.viewBox.baseVal;
    const copy = svg.cloneNode(true), image = new Image(2000, 2000 * height / width);
    copy.setAttribute("width", image.width);
    copy.setAttribute("height", image.height);
    image.onload = () => saved(name, image, width, height);
    image.src = "data:image/svg+xml;utf8," + encodeURIComponent(new XMLSerializer().serializeToString(copy));
  });
  line.firstElementChild.after(" ", button);
}

// long tables: a filter, a copy for a spreadsheet, headings that sort
const LONG = 20;
const text = (cell) => (cell?.querySelector(".own") ?? cell)?.textContent.replace(/\u00a0/g, " ").trim() ?? "";
const number = (cell) => {
  const found = text(cell).replace(/−/g, "-").match(/-?\d+(\.\d+)?(e-?\d+)?/);
  return found ? +found[0] : NaN;
};
for (const table of document.querySelectorAll("table")) {
  const rows = [...table.tBodies[0].rows], heads = [...table.tHead.rows[0].cells];
  if (rows.length <= LONG) continue;
  const tools = document.createElement("p"), filter = document.createElement("input");
  const copy = document.createElement("button"), count = document.createElement("span");
  tools.className = "tools";
  filter.type = "search";
  filter.placeholder = "Filter the rows";
  filter.setAttribute("aria-label", "Filter the rows");
  copy.type = "button";
  copy.textContent = "Copy table";
  count.setAttribute("role", "status");
  tools.append(filter, copy, count);
  (table.closest(".scroll") ?? table).before(tools);
  const tell = (more = "") => {
    const shown = rows.filter((row) => !row.hidden).length;
    count.textContent = `${shown} of ${rows.length} rows${more}`;
  };
  filter.addEventListener("input", () => {
    const sought = filter.value.trim().toLowerCase();
    for (const row of rows) row.hidden = ![...row.cells].some((cell) => text(cell).toLowerCase().includes(sought));
    tell();
  });
  copy.addEventListener("click", () => {
    const shown = [...table.rows].filter((row) => !row.hidden);
    const lines = shown.map((row) => [...row.cells].map(text).join("\t")).join("\n");
    navigator.clipboard.writeText(lines).then(() => tell(", copied"), () => tell(", not copied"));
  });
  heads.forEach((head, at) => {
    const button = document.createElement("button");
    button.type = "button";
    button.append(...head.childNodes);
    head.append(button);
    const isNumber = rows.some((row) => !isNaN(number(row.cells[at])));
    button.addEventListener("click", () => {
      const turned = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
      heads.forEach((each) => each.removeAttribute("aria-sort"));
      head.setAttribute("aria-sort", turned > 0 ? "ascending" : "descending");
      const by = (a, b) => {
        const [p, q] = [a.cells[at], b.cells[at]], [m, n] = [number(p), number(q)];
        if (!isNumber || (isNaN(m) && isNaN(n))) return turned * text(p).localeCompare(text(q));
        return isNaN(m) - isNaN(n) || turned * (m - n) || 0;
      };
      table.tBodies[0].append(...[...rows].sort(by));
    });
  });
  tell();
}

// print has all rows, as they stand
addEventListener("beforeprint", () => {
  for (const box of document.querySelectorAll(".tools input")) {
    box.value = "";
    box.dispatchEvent(new Event("input"));
  }
});
