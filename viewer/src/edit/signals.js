// Curves and dials over time, as src/vocal and src/synthesis have them.

const LEAST_GAP = 1e-4;

/** The dials, their range and what they are left at; `preview`: what the page can show by itself. */
export const DIALS = [
  { name: 'strength', label: 'Strength', least: 0, usual: 1, most: 2, step: 0.05, preview: true },
  { name: 'jaw', label: 'Jaw', least: 0, usual: 1, most: 2, step: 0.05 },
  { name: 'lips', label: 'Lips', least: 0, usual: 1, most: 2, step: 0.05 },
  { name: 'hold', label: 'Hold', least: 0, usual: 0, most: 1, step: 0.05, preview: true },
  { name: 'lead', label: 'Lead', unit: 'ms', least: -200, usual: 0, most: 200, step: 5, preview: true },
  { name: 'smooth', label: 'Smoothing', unit: 'ms', least: 0, usual: 0, most: 200, step: 5, preview: true },
  { name: 'ma', label: 'Ma', least: 0, usual: 0, most: 1, step: 0.05 },
  { name: 'ps', label: 'Ps', least: 0, usual: 0, most: 1, step: 0.05 },
  { name: 'ja', label: 'Ja', least: 0, usual: 1, most: 2, step: 0.05 },
  { name: 'li', label: 'Li', least: 0, usual: 1, most: 2, step: 0.05 },
];
export const dialOf = (name) => DIALS.find((dial) => dial.name === name);

/** Straight lines between points [time, value], held beyond them. */
export function signalAt(points, time) {
  const next = points.findIndex(([at]) => at > time);
  if (next === 0) return points[0][1];
  if (next < 0) return points[points.length - 1][1];
  const [[t0, v0], [t1, v1]] = [points[next - 1], points[next]];
  return v0 + ((v1 - v0) * (time - t0)) / (t1 - t0);
}

/** A dial's signal with one edit in force over its span (withEdit of src/synthesis/line_edits.cpp). */
function signalWith(points, edit) {
  const length = edit.end_s - edit.start_s;
  const fade = Math.min(Math.max(edit.fade_s ?? 0.05, LEAST_GAP), 0.49 * length);
  const inner = edit.keys ? edit.keys.map(({ time_s: time, value }) => [time, value]) : [[edit.start_s + length / 2, edit.value]];
  const made = [];
  const add = (time, value) => {
    if (!made.length || time > made[made.length - 1][0]) made.push([time, value]);
  };
  for (const [time, value] of points) if (time < edit.start_s) add(time, value);
  add(edit.start_s, signalAt(points, edit.start_s));
  add(edit.start_s + fade, signalAt(inner, edit.start_s + fade));
  for (const [time, value] of inner) if (time > edit.start_s + fade && time < edit.end_s - fade) add(time, value);
  add(edit.end_s - fade, signalAt(inner, edit.end_s - fade));
  add(edit.end_s, signalAt(points, edit.end_s));
  for (const [time, value] of points) add(time, value);
  return made;
}

export function dialSignal(edits, name) {
  return edits.filter((edit) => edit.kind === 'dial' && edit.dial === name).reduce(signalWith, [[0, dialOf(name).usual]]);
}

/** Of keys [time, value, in, out]: value and slope of the cubic between them. */
export function curveAt(keys, time) {
  if (!keys.length) return { value: 0, slope: 0 };
  const next = keys.findIndex(([at]) => at > time);
  if (next === 0) return { value: keys[0][1], slope: 0 };
  if (next < 0) return { value: keys[keys.length - 1][1], slope: 0 };
  const [[t0, v0, , m0], [t1, v1, m1]] = [keys[next - 1], keys[next]];
  const h = t1 - t0;
  const u = (time - t0) / h;
  const value = (2 * u ** 3 - 3 * u ** 2 + 1) * v0 + (u ** 3 - 2 * u ** 2 + u) * h * m0 + (-2 * u ** 3 + 3 * u ** 2) * v1 + (u ** 3 - u ** 2) * h * m1;
  const slope = ((6 * u ** 2 - 6 * u) / h) * (v0 - v1) + (3 * u ** 2 - 4 * u + 1) * m0 + (3 * u ** 2 - 2 * u) * m1;
  return { value, slope };
}

/** Slopes that never overshoot (Fritsch and Butland), as withMonotoneSlopes() of src/vocal. */
function monotone(keys) {
  const chord = (i) => (keys[i + 1][1] - keys[i][1]) / (keys[i + 1][0] - keys[i][0]);
  return keys.map(([time, value], i) => {
    if (i === 0 || i === keys.length - 1) return [time, value, 0, 0];
    const [before, after] = [chord(i - 1), chord(i)];
    if (before * after <= 0) return [time, value, 0, 0];
    const [h0, h1] = [time - keys[i - 1][0], keys[i + 1][0] - time];
    const slope = (3 * (h0 + h1)) / ((2 * h1 + h0) / before + (h1 + 2 * h0) / after);
    return [time, value, slope, slope];
  });
}

/** The curve's keys with a "replace" edit made, as withEdits() of src/vocal. */
export function replaced(keys, edit) {
  const cut = (time) => {
    const { value, slope } = curveAt(keys, time);
    return [time, value, slope, slope];
  };
  const [first, last] = [cut(edit.start_s), cut(edit.end_s)];
  const span = monotone([first, ...edit.keys.map(({ time_s: time, value }) => [time, value, 0, 0]).filter(([time]) => time > first[0] && time < last[0]), last]);
  span[0] = first;
  span[span.length - 1] = last;
  return [...keys.filter(([time]) => time < edit.start_s - LEAST_GAP / 2), ...span, ...keys.filter(([time]) => time > edit.end_s + LEAST_GAP / 2)];
}
