// Small changes on the face at once: the weights of its shapes, frame after frame, as they would be with the edits. What
// the page cannot know by itself (jaw, lips, words, borders, units) waits until the line is made again.
import { curveAt, dialOf, dialSignal, replaced, signalAt } from './signals.js';

const smoothStep = (x) => {
  const t = Math.min(Math.max(x, 0), 1);
  return t * t * (3 - 2 * t);
};

/** The line's curves with all "replace" edits beyond the applied ones. */
export function editedCurves(curves, edits) {
  const list = edits.list.slice(commonLength(edits.list, edits.applied));
  return curves.map((curve) => ({
    ...curve,
    keys: list.filter((edit) => edit.curve === curve.name && edit.kind === 'replace').reduce((keys, edit) => replaced(keys, edit), curve.keys),
  }));
}

function commonLength(a, b) {
  let length = 0;
  while (length < Math.min(a.length, b.length) && JSON.stringify(a[length]) === JSON.stringify(b[length])) ++length;
  return length;
}

function heldTime(middles, time, hold) {
  const next = middles.findIndex((middle) => middle > time);
  if (next <= 0) return time;
  const [before, after] = [middles[next - 1], middles[next]];
  const share = (time - before) / (after - before);
  return before + (after - before) * ((1 - hold) * share + hold * smoothStep(smoothStep(share)));
}

export class Preview {
  /** track: the KeyframeTracks of the face's weights, whose values are changed in place. */
  constructor(data, tracks) {
    this.data = data;
    this.tracks = tracks.map((track) => ({ track, own: track.values.slice(), count: track.values.length / track.times.length }));
    this.middles = data.report.phones.map(({ start_s: start, end_s: end }) => (start + end) / 2);
  }

  /** Weights of all shapes that were made elsewhere, frame after frame; false where they do not fit this face. */
  take(frames, weights) {
    const fits = this.tracks.length > 0 && this.tracks.every(({ track, count }) => track.times.length === frames && count * frames === weights.length);
    if (fits) for (const { track } of this.tracks) track.values.set(weights);
    return fits;
  }

  show(edits) {
    const signals = {};
    for (const name of ['strength', 'hold', 'lead', 'smooth']) signals[name] = [dialSignal(edits.applied, name), dialSignal(edits.list, name)];
    for (const one of this.tracks) {
      one.track.values.set(one.own);
      this.#retime(one, signals);
      this.#smooth(one, signals.smooth);
      this.#scale(one, signals.strength);
      this.#draw(one, edits);
    }
  }

  #retime({ track, own, count }, { hold, lead }) {
    if (JSON.stringify([hold[0], lead[0]]) === JSON.stringify([hold[1], lead[1]])) return;
    const { times } = track;
    const map = (which, time) => heldTime(this.middles, time + signalAt(lead[which], time) / 1000, signalAt(hold[which], time));
    const undone = (wanted) => {  // the time at which the shown line has what the line itself has at `wanted`
      let [low, high] = [wanted - 0.5, wanted + 0.5];
      for (let i = 0; i < 24; ++i) {
        const middle = (low + high) / 2;
        if (map(0, middle) < wanted) low = middle;
        else high = middle;
      }
      return (low + high) / 2;
    };
    const rate = (times.length - 1) / (times[times.length - 1] || 1);
    for (let frame = 0; frame < times.length; ++frame) {
      const at = Math.min(Math.max(undone(map(1, times[frame])) * rate, 0), times.length - 1);
      const [before, after] = [Math.floor(at), Math.min(Math.floor(at) + 1, times.length - 1)];
      for (let k = 0; k < count; ++k) track.values[frame * count + k] = (1 - (at - before)) * own[before * count + k] + (at - before) * own[after * count + k];
    }
  }

  #smooth({ track, count }, [was, is]) {
    if (JSON.stringify(was) === JSON.stringify(is)) return;
    const { times } = track;
    const rate = (times.length - 1) / (times[times.length - 1] || 1);
    const own = track.values.slice();
    for (let frame = 0; frame < times.length; ++frame) {
      const [old, now] = [signalAt(was, times[frame]), signalAt(is, times[frame])];
      const deviation = (Math.sqrt(Math.max(0, now * now - old * old)) / 1000) * rate;
      if (deviation <= 0.05) continue;
      const reach = Math.ceil(3 * deviation);
      const sums = new Float64Array(count);
      let weight = 0;
      for (let other = frame - reach; other <= frame + reach; ++other) {
        const share = Math.exp(-0.5 * ((other - frame) / deviation) ** 2);
        const from = Math.min(Math.max(other, 0), times.length - 1) * count;
        for (let k = 0; k < count; ++k) sums[k] += share * own[from + k];
        weight += share;
      }
      for (let k = 0; k < count; ++k) track.values[frame * count + k] = sums[k] / weight;
    }
  }

  #scale({ track, count }, [was, is]) {
    if (JSON.stringify(was) === JSON.stringify(is)) return;
    for (let frame = 0; frame < track.times.length; ++frame) {
      const time = track.times[frame];
      const share = signalAt(is, time) / Math.max(0.05, signalAt(was, time));
      for (let k = 0; k < count; ++k) track.values[frame * count + k] *= share;
    }
  }

  /** What the changed curves move beyond the line's own ones. */
  #draw({ track, count }, edits) {
    const { poses } = this.data.editing ?? {};
    if (!poses?.lips.length) return;
    const now = editedCurves(this.data.curves, edits);
    const first = count - poses.jaw.length;  // a head's own shapes come before
    now.forEach((curve, index) => {
      const was = this.data.curves[index].keys;
      if (curve.keys === was) return;
      const isJaw = curve.name.endsWith('_jaw');
      const pose = poses.names.indexOf(isJaw ? curve.name.slice(0, -4) : curve.name);
      if (pose < 0) return;
      const hasJaw = isJaw || !this.data.curves.some(({ name }) => name === `${curve.name}_jaw`);
      const move = poses.jaw.map((jaw, k) => (isJaw ? 0 : poses.lips[pose][k]) + (hasJaw ? poses.jaw_drop[pose] * jaw : 0));
      for (let frame = 0; frame < track.times.length; ++frame) {
        const time = track.times[frame];
        const more = curveAt(curve.keys, time).value - curveAt(was, time).value;
        if (more === 0) continue;
        for (let k = 0; k < move.length; ++k) track.values[frame * count + first + k] += more * move[k];
      }
    });
  }
}

/** Whether an edit is seen at once in the page. */
export const isShownAtOnce = (edit) => (edit.kind === 'dial' ? Boolean(dialOf(edit.dial)?.preview) : edit.kind === 'replace');
