// Dials and curves as tracks on the timeline's axis: keys that are dragged, added by a double click, taken away by Delete.
import { editedCurves } from './preview.js';
import { curveAt, DIALS, dialOf, dialSignal, signalAt } from './signals.js';

const HEIGHT = 62;
const MARGIN = 8;
const REACH_PX = 9;
const LEAST_GAP_S = 0.004;
const FIRST_SHOWN = ['strength', 'hold', 'lead', 'smooth'];
const CURVES_FIRST_SHOWN = 2;

class Track {
  constructor(name, label, owner) {
    this.name = name;
    this.owner = owner;
    this.selected = -1;
    this.row = document.createElement('div');
    this.row.className = 'edit-track';
    this.canvas = document.createElement('canvas');
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute('role', 'slider');
    this.canvas.setAttribute('aria-label', `${label}: arrows move the key that is chosen, page up and down choose one, Enter adds one where the line is, Delete takes it away`);
    this.label = document.createElement('span');
    this.label.className = 'edit-label';
    this.label.textContent = label;
    this.row.append(this.canvas, this.label);
    this.canvas.addEventListener('pointerdown', (event) => this.#grab(event));
    this.canvas.addEventListener('pointermove', (event) => this.#drag(event));
    for (const end of ['pointerup', 'pointercancel']) this.canvas.addEventListener(end, () => this.#drop());
    this.canvas.addEventListener('dblclick', (event) => this.#addAt(event));
    this.canvas.addEventListener('keydown', (event) => this.#key(event));
  }

  /** {keys: [{time_s, value}], least, most, at(time)}. */
  get state() {
    return this.owner.stateOf(this.name);
  }

  xOf(time) {
    const { start, end, width } = this.owner.window;
    return ((time - start) / (end - start)) * width;
  }

  yOf(value, { least, most }) {
    return HEIGHT - MARGIN - ((value - least) / (most - least)) * (HEIGHT - 2 * MARGIN);
  }

  draw() {
    const { start, end, width } = this.owner.window;
    const scale = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(width * scale);
    this.canvas.height = Math.round(HEIGHT * scale);
    this.canvas.style.width = `${width}px`;
    this.canvas.style.height = `${HEIGHT}px`;
    const context = this.canvas.getContext('2d');
    context.scale(scale, scale);
    const style = getComputedStyle(this.canvas);
    const { state } = this;
    context.strokeStyle = style.getPropertyValue('--edge');
    context.beginPath();
    context.moveTo(0, this.yOf(state.usual, state));
    context.lineTo(width, this.yOf(state.usual, state));
    context.stroke();
    context.strokeStyle = context.fillStyle = style.getPropertyValue(this.owner.isDial(this.name) ? '--accent' : '--text');
    context.lineWidth = 1.6;
    context.beginPath();
    for (let x = 0; x <= width; x += 2) context.lineTo(x, this.yOf(state.at(start + ((end - start) * x) / width), state));
    context.stroke();
    state.keys.forEach(({ time_s: time, value }, index) => {
      context.beginPath();
      context.arc(this.xOf(time), this.yOf(value, state), index === this.selected ? 5.5 : 3.5, 0, 2 * Math.PI);
      context.fill();
    });
    const key = state.keys[this.selected];
    this.canvas.setAttribute('aria-valuemin', state.least);
    this.canvas.setAttribute('aria-valuemax', state.most);
    this.canvas.setAttribute('aria-valuenow', Number((key?.value ?? state.at(this.owner.clock.time)).toFixed(3)));
    this.canvas.setAttribute('aria-valuetext', key ? `${key.value.toFixed(2)} at ${key.time_s.toFixed(2)} seconds` : `${state.keys.length} keys`);
  }

  #place(event) {
    const box = this.canvas.getBoundingClientRect();
    const { start, end } = this.owner.window;
    const { least, most } = this.state;
    const share = (HEIGHT - MARGIN - (event.clientY - box.top)) / (HEIGHT - 2 * MARGIN);
    return {
      time: start + ((end - start) * (event.clientX - box.left)) / box.width,
      value: Math.min(Math.max(least + share * (most - least), least), most),
    };
  }

  #grab(event) {
    if (event.button !== 0) return;
    const box = this.canvas.getBoundingClientRect();
    const [x, y] = [event.clientX - box.left, event.clientY - box.top];
    const { state } = this;
    const away = state.keys.map(({ time_s: time, value }) => Math.hypot(this.xOf(time) - x, this.yOf(value, state) - y));
    const nearest = away.indexOf(Math.min(...away));
    this.selected = away[nearest] <= REACH_PX ? nearest : -1;
    event.stopPropagation();  // else the timeline takes the pointer
    if (this.selected < 0) this.owner.clock.seek(this.#place(event).time);
    else {
      this.canvas.setPointerCapture(event.pointerId);
      this.gesture = `${this.name} ${event.timeStamp}`;
    }
    this.draw();
  }

  #drag(event) {
    if (!this.gesture) return;
    const { time, value } = this.#place(event);
    this.#move(time, value, this.gesture);
  }

  #drop() {
    if (this.gesture) this.owner.edits.settle();
    this.gesture = null;
  }

  #addAt(event) {
    event.stopPropagation();
    const { time, value } = this.#place(event);
    this.#add(time, value);
  }

  #add(time, value) {
    const keys = [...this.state.keys, { time_s: time, value }].sort((a, b) => a.time_s - b.time_s);
    this.selected = keys.findIndex(({ time_s: at }) => at === time);
    this.owner.put(this.name, keys, this.selected, null);
  }

  #move(time, value, gesture) {
    const { keys, least, most } = this.state;
    if (!keys[this.selected]) return;
    const moved = keys.map((key) => ({ ...key }));
    const from = (keys[this.selected - 1]?.time_s ?? -LEAST_GAP_S) + LEAST_GAP_S;
    const to = (keys[this.selected + 1]?.time_s ?? this.owner.clock.duration + LEAST_GAP_S) - LEAST_GAP_S;
    moved[this.selected] = { time_s: Math.min(Math.max(time, from), to), value: Math.min(Math.max(value, least), most) };
    this.owner.put(this.name, moved, this.selected, gesture);
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { keys, least, most } = this.state;
    const key = keys[this.selected];
    const step = (most - least) / 40;
    const move = (time, value) => () => key && this.#move(key.time_s + time, key.value + value, null);
    const choose = (by) => () => {
      this.selected = Math.min(Math.max(this.selected + by, 0), keys.length - 1);
      this.draw();
    };
    const action = {
      PageDown: choose(1), PageUp: choose(-1),
      ArrowUp: move(0, step), ArrowDown: move(0, -step), ArrowLeft: move(-0.01, 0), ArrowRight: move(0.01, 0),
      Enter: () => this.#add(this.owner.clock.time, this.state.at(this.owner.clock.time)),
      Delete: () => key && this.#remove(), Backspace: () => key && this.#remove(),
    }[event.key];
    if (!action) return;
    event.preventDefault();
    event.stopPropagation();
    action();
  }

  #remove() {
    this.owner.take(this.name, this.selected);
    this.selected = -1;
    this.draw();
  }
}

export class Tracks {
  /** timeline: where they stand, and its window of time. */
  constructor(data, edits, clock, timeline) {
    this.data = data;
    this.edits = edits;
    this.clock = clock;
    this.timeline = timeline;
    this.place = document.getElementById('edit-tracks');
    this.chooser = document.getElementById('edit-add');
    this.shown = [];
    this.chooser.append(new Option('Show a track …', ''));
    for (const dial of DIALS) this.chooser.append(new Option(`${dial.label}${dial.unit ? ` (${dial.unit})` : ''}`, dial.name));
    for (const { name } of data.curves) this.chooser.append(new Option(`Curve ${name}`, `curve:${name}`));
    this.chooser.addEventListener('change', () => {
      this.toggle(this.chooser.value);
      this.chooser.value = '';
    });
    for (const name of FIRST_SHOWN) this.toggle(name);
    const busiest = [...data.curves].sort((a, b) => b.keys.length - a.keys.length).slice(0, CURVES_FIRST_SHOWN);
    for (const { name } of busiest) this.toggle(`curve:${name}`);
    edits.addEventListener('change', () => this.draw());
  }

  get window() {
    return this.timeline.window;
  }

  isDial(name) {
    return !name.startsWith('curve:');
  }

  toggle(name) {
    if (!name) return;
    const known = this.shown.find((track) => track.name === name);
    if (known) {
      known.row.remove();
      this.shown = this.shown.filter((track) => track !== known);
      return;
    }
    const dial = dialOf(name);
    const track = new Track(name, dial ? `${dial.label}${dial.unit ? `, ${dial.unit}` : ''}` : name.slice(6), this);
    this.shown.push(track);
    this.place.append(track.row);
    if (this.isOpen) track.draw();
  }

  stateOf(name) {
    const dial = dialOf(name);
    if (dial) {
      const signal = dialSignal(this.edits.list, name);
      const edit = this.edits.list.find((one) => one.kind === 'dial' && one.dial === name && one.keys);
      return { keys: edit?.keys ?? [], least: dial.least, most: dial.most, usual: dial.usual, at: (time) => signalAt(signal, time) };
    }
    const { keys } = editedCurves(this.data.curves, this.edits).find((curve) => `curve:${curve.name}` === name);
    const isUnit = /^lip(Spread|Round)$/.test(name.slice(6));
    return { keys: keys.map(([time, value]) => ({ time_s: time, value })), least: isUnit ? -1.25 : 0, most: 1.25, usual: 0, at: (time) => curveAt(keys, time).value };
  }

  /** The track's keys, of which the one at `changed` is new or was moved. */
  put(name, keys, changed, gesture) {
    const dial = dialOf(name);
    if (dial) return this.edits.setDial(dial, keys, this.clock.duration, gesture);
    const start = keys[changed - 1]?.time_s ?? keys[changed].time_s - 0.1;
    const end = keys[changed + 1]?.time_s ?? keys[changed].time_s + 0.1;
    if (this.edits.gesture === gesture && gesture && this.span?.gesture === gesture) {
      return this.edits.replaceCurve(name.slice(6), this.span.start, this.span.end, [keys[changed]], gesture);
    }
    this.span = { gesture, start, end };
    return this.edits.replaceCurve(name.slice(6), start, end, [keys[changed]], gesture);
  }

  take(name, index) {
    const { keys } = this.stateOf(name);
    const dial = dialOf(name);
    const left = keys.filter((_, i) => i !== index);
    if (dial) return this.edits.setDial(dial, left, this.clock.duration, null);
    const [before, after] = [keys[index - 1], keys[index + 1]];
    if (!before || !after) return undefined;
    const middle = (before.time_s + after.time_s) / 2;
    return this.edits.replaceCurve(name.slice(6), before.time_s, after.time_s, [{ time_s: middle, value: (before.value + after.value) / 2 }], null);
  }

  draw() {
    if (this.isOpen) for (const track of this.shown) track.draw();
  }
}
