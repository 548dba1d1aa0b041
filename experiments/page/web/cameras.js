// What both cameras saw, with the estimated marker as circles: the inner one dotted, in the ball's colour.

import {h, soon} from 'page/dom.js';
import {inverse, transform} from 'page/series.js';

const kSides = ['left', 'right'];

export class Cameras {
  constructor(host, trial) {
    this.trial = trial;
    this.pictures = {};
    this.estimate = {pose: null, isFound: false};
    this.caption = h('p', {class: 'note', 'aria-live': 'off'});
    this.views = kSides.map(side =>
      h('canvas', {
        width: trial.rig.width_px,
        height: trial.rig.height_px,
        role: 'img',
        'aria-label': `${side} camera with the estimated marker`,
      }),
    );
    const figures = kSides.map((side, k) =>
      h('figure', {}, this.views[k], h('figcaption', {}, side)),
    );
    host.append(h('div', {class: 'cameras'}, figures), this.caption);
    this.draw = soon(() => kSides.forEach((side, k) => this.drawSide(side, this.views[k])));
    this.draw();
  }

  /**
   * pictures: {left, right} as images, bitmaps or canvases; estimate: theirs, {pose of M in H, isFound}; caption: text.
   */
  show(pictures, estimate, caption) {
    Object.assign(this, {pictures, estimate});
    if (this.caption.textContent !== caption) this.caption.textContent = caption;
    this.draw();
  }

  /** Circles of the balls in one camera: [{u, v, radius, rgb}], in pixels. */
  circles(side) {
    const {fx_px, fy_px, cx_px, cy_px, X_HC} = this.trial.rig[side];
    const {pose} = this.estimate;
    if (!pose) return [];
    return this.trial.marker.balls.flatMap(({p_MQ_m, radius_m, display_rgb}) => {
      const [x, y, z] = transform(inverse(X_HC), transform(pose, p_MQ_m));
      if (z < 1e-3) return [];
      return {
        u: (fx_px * x) / z + cx_px,
        v: (fy_px * y) / z + cy_px,
        radius: (fx_px * radius_m) / z,
        rgb: display_rgb,
      };
    });
  }

  drawSide(side, canvas) {
    const c = canvas.getContext('2d');
    const {width, height} = canvas;
    c.fillStyle = '#0a1218';
    c.fillRect(0, 0, width, height);
    const picture = this.pictures[side];
    if (picture) c.drawImage(picture, 0, 0, width, height);
    const unit = width / 640;
    c.globalAlpha = this.estimate.isFound ? 1 : 0.55;
    const circle = (u, v, radius, color, line, dash) => {
      c.strokeStyle = color;
      c.lineWidth = line * unit;
      c.setLineDash(dash.map(length => length * unit));
      c.beginPath();
      c.arc(u + 0.5, v + 0.5, radius, 0, 2 * Math.PI);
      c.stroke();
    };
    for (const {u, v, radius, rgb} of this.circles(side)) {
      const color = `rgb(${rgb.map(x => Math.round(255 * x)).join(' ')})`;
      circle(u, v, radius, color, 2.4, [4, 4]);
      circle(u, v, radius * this.trial.marker.outer_ring_ratio, '#fff', 1.3, []);
    }
    c.globalAlpha = 1;
  }
}
