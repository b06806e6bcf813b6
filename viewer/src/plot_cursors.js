/** The moment of the replay in the page's plots over time; a click there seeks. */

const SVG = 'http://www.w3.org/2000/svg';

export class PlotCursors {
  constructor(seek) {
    this.plots = [...document.querySelectorAll('svg.time')].map(svg => {
      const {t0, t1, x0, x1, y0, y1} = Object.fromEntries(Object.entries(svg.dataset).map(([k, v]) => [k, Number(v)]));
      const line = document.createElementNS(SVG, 'line');
      line.setAttribute('class', 'cursor');
      line.setAttribute('y1', y0);
      line.setAttribute('y2', y1);
      svg.append(line);
      svg.addEventListener('click', event => {
        const box = svg.getBoundingClientRect();
        const x = ((event.clientX - box.left) / box.width) * svg.viewBox.baseVal.width;
        seek(t0 + ((x - x0) / (x1 - x0)) * (t1 - t0));
      });
      return {line, place: t => x0 + ((Math.min(t1, Math.max(t0, t)) - t0) / (t1 - t0)) * (x1 - x0)};
    });
  }
  show(time) {
    for (const {line, place} of this.plots) {
      const x = place(time).toFixed(1);
      line.setAttribute('x1', x);
      line.setAttribute('x2', x);
    }
  }
}
