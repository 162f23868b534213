// Plane geometry of the photo, in its pixels.

export const distance = (a, b) => Math.hypot(a[0] - b[0], a[1] - b[1]);

// A point of an ellipse of observations.jsonl.
export function ellipsePoint({center, axes, angle_rad: angle}, t) {
  const x = axes[0] * Math.cos(t), y = axes[1] * Math.sin(t);
  return [center[0] + x * Math.cos(angle) - y * Math.sin(angle),
          center[1] + x * Math.sin(angle) + y * Math.cos(angle)];
}

// About the distance from a point to the ellipse: exact for a circle, first-order else.
export function ellipseDistance({center, axes, angle_rad: angle}, point) {
  const dx = point[0] - center[0], dy = point[1] - center[1];
  const x = dx * Math.cos(angle) + dy * Math.sin(angle);
  const y = dy * Math.cos(angle) - dx * Math.sin(angle);
  const r = Math.hypot(x / axes[0], y / axes[1]);
  const slope = Math.hypot(x / axes[0] ** 2, y / axes[1] ** 2);
  return r > 0 ? Math.abs(r - 1) * r / slope : axes[1];
}

export function segmentDistance([x0, y0, x1, y1], [x, y]) {
  const dx = x1 - x0, dy = y1 - y0;
  const t = Math.max(0, Math.min(1, ((x - x0) * dx + (y - y0) * dy) / (dx * dx + dy * dy || 1)));
  return Math.hypot(x - x0 - t * dx, y - y0 - t * dy);
}

// The found segment that a drawn one lies along: both its ends within `reach` of the other's line,
// and half of the shorter one beside the other. Its ends, in the sense of the drawn one; or null.
export function snap(points, segments, reach) {
  const [ax, ay, bx, by] = points;
  const drawn = Math.hypot(bx - ax, by - ay);
  let best = null, least = reach;
  for (const [x0, y0, x1, y1] of segments) {
    const length = Math.hypot(x1 - x0, y1 - y0);
    const dx = (x1 - x0) / length, dy = (y1 - y0) / length;
    const off = (x, y) => Math.abs((x - x0) * dy - (y - y0) * dx);
    const along = (x, y) => (x - x0) * dx + (y - y0) * dy;
    const a = along(ax, ay), b = along(bx, by);
    const beside = Math.min(Math.max(a, b), length) - Math.max(Math.min(a, b), 0);
    const miss = Math.max(off(ax, ay), off(bx, by));
    if (miss >= least || beside < 0.5 * Math.min(length, drawn)) continue;
    least = miss;
    best = b > a ? [x0, y0, x1, y1] : [x1, y1, x0, y0];
  }
  return best;
}
