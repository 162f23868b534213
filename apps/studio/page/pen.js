// Strokes that are seen on any photo.
import {ellipsePoint} from './geometry.js';

export const COLORS = {
  x: '#ff5a52', y: '#34c759', z: '#4d9bff', free: '#e38bff', circle: '#ffc53d', found: '#9fdcff',
  known: '#ffffff', measure: '#7ff0d0', horizon: '#8fe3ff',
};


// A pen on any canvas: `place` puts pixels of the photo there, `thin` scales strokes.
export class Pen {
  constructor(context, place, thin = 1) {
    Object.assign(this, {context, place, thin});
    context.lineCap = context.lineJoin = 'round';
  }

  // Points that are null break it. A dark rim keeps it seen on any photo.
  curve(points, color, width, {dash = [], rim = true, close = false, alpha = 1} = {}) {
    const c = this.context;
    c.beginPath();
    let pen = false;
    for (const point of points) {
      if (!point) { pen = false; continue; }
      const [x, y] = this.place(point);
      if (Math.abs(x) > 1e5 || Math.abs(y) > 1e5) { pen = false; continue; }
      if (pen) c.lineTo(x, y); else c.moveTo(x, y);
      pen = true;
    }
    if (close) c.closePath();
    c.globalAlpha = alpha;
    c.setLineDash(dash);
    if (rim) {
      c.strokeStyle = 'rgba(0, 0, 0, 0.55)';
      c.lineWidth = (width + 2) * this.thin;
      c.stroke();
    }
    c.strokeStyle = color;
    c.lineWidth = width * this.thin;
    c.stroke();
    c.setLineDash([]);
    c.globalAlpha = 1;
  }

  line([x0, y0, x1, y1], color, width, options) {
    this.curve([[x0, y0], [x1, y1]], color, width, options);
  }

  ellipse(ellipse, color, width, options) {
    if (!ellipse || !ellipse.center) return;
    const points = Array.from({length: 97}, (_, i) => ellipsePoint(ellipse, i * Math.PI / 48));
    this.curve(points, color, width, options);
  }

  arrow(points, color, width) {
    const seen = points.filter(Boolean);
    if (seen.length < 2) return;
    this.curve(points, color, width);
    const tip = this.place(seen[seen.length - 1]), before = this.place(seen[0]);
    const angle = Math.atan2(tip[1] - before[1], tip[0] - before[0]), c = this.context;
    c.beginPath();
    c.moveTo(...tip);
    for (const turn of [2.65, -2.65]) {
      c.lineTo(tip[0] + 4 * width * this.thin * Math.cos(angle + turn),
               tip[1] + 4 * width * this.thin * Math.sin(angle + turn));
    }
    c.closePath();
    c.fillStyle = color;
    c.fill();
  }

  ring(point, radius, color, {fill = null, width = 2} = {}) {
    const [x, y] = this.place(point), c = this.context;
    c.beginPath();
    c.arc(x, y, radius, 0, 2 * Math.PI);
    c.lineWidth = width + 2;
    c.strokeStyle = 'rgba(0, 0, 0, 0.6)';
    c.stroke();
    if (fill) { c.fillStyle = fill; c.fill(); }
    c.lineWidth = width;
    c.strokeStyle = color;
    c.stroke();
  }

  cross(point, radius, color) {
    const [x, y] = this.place(point);
    for (const [dx, dy] of [[radius, 0], [0, radius]]) {
      const ends = [[x - dx, y - dy], [x + dx, y + dy]];
      new Pen(this.context, (p) => p).curve(ends, color, 2);
    }
  }

  label(point, text, color, [dx, dy] = [0, -14]) {
    const [x, y] = this.place(point), c = this.context;
    c.font = '600 12px system-ui, sans-serif';
    const width = c.measureText(text).width;
    c.fillStyle = 'rgba(12, 16, 22, 0.78)';
    c.beginPath();
    c.roundRect(x + dx - width / 2 - 6, y + dy - 10, width + 12, 20, 6);
    c.fill();
    c.fillStyle = color;
    c.textAlign = 'center';
    c.textBaseline = 'middle';
    c.fillText(text, x + dx, y + dy + 0.5);
  }
}
