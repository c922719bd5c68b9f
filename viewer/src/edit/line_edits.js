// The list of an animator's changes (docs/formats/edits.md), with undo. `applied`: those that the shown line was made with.

const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);

export class LineEdits extends EventTarget {
  constructor(applied) {
    super();
    this.applied = structuredClone(applied);
    this.list = structuredClone(applied);
    this.past = [];
    this.future = [];
  }

  get isChanged() {
    return !same(this.list, this.applied);
  }

  /** Makes a change; changes of one `gesture` (a drag) are undone together. */
  change(make, gesture = null) {
    const before = structuredClone(this.list);
    make(this.list);
    if (same(before, this.list)) return;
    if (!gesture || gesture !== this.gesture) {
      this.past.push(before);
      this.future = [];
    }
    this.gesture = gesture;
    this.#tell();
  }

  /** The end of a drag: the next one is another step. */
  settle() {
    this.gesture = null;
  }

  undo() {
    this.#step(this.past, this.future);
  }

  redo() {
    this.#step(this.future, this.past);
  }

  #step(from, to) {
    if (!from.length) return;
    to.push(structuredClone(this.list));
    this.list = from.pop();
    this.gesture = null;
    this.#tell();
  }

  /** What a page that takes this one's place goes on with. */
  get kept() {
    return { list: this.list, past: this.past, future: this.future };
  }

  restore(kept) {
    Object.assign(this, structuredClone(kept));
    this.#tell();
  }

  #tell() {
    this.dispatchEvent(new Event('change'));
  }

  /** A dial as one track over the whole line; without keys it is no edit. */
  setDial(dial, keys, duration, gesture) {
    this.change((list) => {
      const others = list.filter((edit) => !(edit.kind === 'dial' && edit.dial === dial.name));
      list.splice(0, list.length, ...others, ...(!keys.length ? [] : [{ kind: 'dial', dial: dial.name, start_s: 0, end_s: duration, fade_s: 0, keys }]));
    }, gesture);
  }

  moveBorder(before, after, from, to, gesture) {
    this.change((list) => {
      // One that was moved before is told from where the line itself has it.
      const known = list.find((edit) => edit.kind === 'border' && edit.before === before && edit.after === after && Math.abs(edit.to_s - from) < 2e-3);
      if (known) known.to_s = to;
      else list.push({ kind: 'border', before, after, at_s: from, to_s: to });
    }, gesture);
  }

  retype(word, number, to) {
    this.change((list) => list.push({ kind: 'word', word, number, to }));
  }

  takeUnit(phones, start, take, sourceStart) {
    this.change((list) => list.push({ kind: 'unit', phones, start_s: start, take, source_start_s: sourceStart }));
  }

  drawWithCurves(phones, start) {
    this.change((list) => list.push({ kind: 'curves', phones, start_s: start }));
  }

  replaceCurve(curve, start, end, keys, gesture) {
    this.change((list) => {
      const last = list[list.length - 1];
      const edit = { curve, kind: 'replace', start_s: start, end_s: end, keys };
      if (gesture && gesture === this.gesture && last?.curve === curve) list[list.length - 1] = edit;
      else list.push(edit);
    }, gesture);
  }

  remove(index) {
    this.change((list) => list.splice(index, 1));
  }
}

/** An edit in a few words for people. */
export function toldOf(edit) {
  const at = (time) => `${time.toFixed(2)} s`;
  if (edit.name) return `all of the curve ${edit.name}`;
  switch (edit.kind) {
    case 'dial': return `${edit.dial} ${edit.keys ? edit.keys.map(({ value }) => Number(value.toFixed(2))).slice(0, 4).join(' → ') : edit.value}`;
    case 'border': return `${edit.before}|${edit.after} from ${at(edit.at_s)} to ${at(edit.to_s)}`;
    case 'word': return `“${edit.word}” becomes “${edit.to}”`;
    case 'unit': return `${edit.phones.join(' ')} at ${at(edit.start_s)} from ${edit.take}`;
    case 'curves': return `${edit.phones.join(' ')} at ${at(edit.start_s)} drawn with curves`;
    default: return `${edit.curve} ${edit.kind} from ${at(edit.start_s)} to ${at(edit.end_s)}`;
  }
}
