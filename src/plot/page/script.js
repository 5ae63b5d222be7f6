"use strict";
const tip = document.getElementById("tip");
const fraction = (axis, value) => axis.log
  ? Math.log(value / axis.low) / Math.log(axis.high / axis.low)
  : (value - axis.low) / (axis.high - axis.low);
const nearest = (axis, place) => {
  let best = 0;
  axis.middles.forEach((middle, i) => {
    if (Math.abs(fraction(axis, middle) - place) < Math.abs(fraction(axis, axis.middles[best]) - place)) best = i;
  });
  return best;
};
const shown = (value) => Number(value.toPrecision(6)).toString();
for (const figure of document.querySelectorAll("figure")) {
  const data = figure.querySelector("script");
  if (!data) continue;
  const maps = JSON.parse(data.textContent);
  const svg = figure.querySelector("svg");
  svg.addEventListener("mousemove", (event) => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const map = maps.find(({ area: [x, y, width, height] }) =>
      at.x >= x && at.x <= x + width && at.y >= y && at.y <= y + height);
    tip.hidden = !map;
    if (!map) return;
    const [x, y, width, height] = map.area;
    const column = nearest(map.x, (at.x - x) / width);
    const row = nearest(map.y, 1 - (at.y - y) / height);
    const cell = row * map.x.middles.length + column;
    const value = map.values[cell];
    const word = map.words[map.word[cell]];
    tip.textContent = `${map.x.name} = ${shown(map.x.middles[column])}\n${map.y.name} = ${shown(map.y.middles[row])}\n`
      + (value === null ? word : `${map.column} = ${shown(value)}` + (word === "ok" ? "" : `\n${word}`));
    tip.style.left = `${Math.min(event.clientX + 14, window.innerWidth - tip.offsetWidth - 4)}px`;
    tip.style.top = `${event.clientY + 14}px`;
  });
  svg.addEventListener("mouseleave", () => { tip.hidden = true; });
}
for (const table of document.querySelectorAll("table")) {
  table.querySelectorAll("th").forEach((head, column) => {
    let up = false;
    head.addEventListener("click", () => {
      up = !up;
      const body = table.tBodies[0];
      const key = (row) => row.cells[column].textContent.replaceAll(",", "");
      const order = (a, b) => {
        const [left, right] = [key(a), key(b)];
        const numbers = left !== "" && right !== "" && !isNaN(left) && !isNaN(right);
        return numbers ? left - right : left.localeCompare(right);
      };
      [...body.rows].sort((a, b) => (up ? order(a, b) : order(b, a))).forEach((row) => body.append(row));
    });
  });
}
