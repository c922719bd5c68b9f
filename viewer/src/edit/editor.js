// The page as an editor of its line: what is under the timeline when "Edit" is pressed.
import { Engine, isMadeHere } from './engine.js';
import { LineEdits, toldOf } from './line_edits.js';
import { isShownAtOnce, Preview } from './preview.js';
import { Served } from './served.js';
import { drawSpectrogram } from './spectrogram.js';
import { nameOf } from '../takes.js';
import { Tracks } from './tracks.js';

const SPECTRUM_HEIGHT = 48;
const BORDER_STEP_S = 0.01;
const SHORTEST_S = 0.01;

const byId = (id) => document.getElementById(id);

function button(text, action, title = '') {
  const made = document.createElement('button');
  made.type = 'button';
  made.className = 'quiet';
  made.textContent = text;
  made.title = title;
  made.addEventListener('click', action);
  return made;
}

export class Editor {
  /** page: {clock, timeline, stage}. */
  constructor(data, page) {
    this.data = data;
    this.page = page;
    this.edits = new LineEdits(Array.isArray(data.editing?.edits) ? data.editing.edits : []);
    this.tracks = new Tracks(data, this.edits, page.clock, page.timeline);
    this.served = new Served();
    this.#listen();
    this.#addBorders();
    this.#refresh();
  }

  #listen() {
    byId('edit').addEventListener('click', () => this.setOpen(!this.isOpen));
    byId('undo').addEventListener('click', () => this.edits.undo());
    byId('redo').addEventListener('click', () => this.edits.redo());
    byId('save-edits').addEventListener('click', () => this.#save());
    byId('apply').addEventListener('click', () => this.#apply());
    this.edits.addEventListener('change', () => this.#refresh());
    this.page.timeline.addEventListener('layout', () => this.#draw());
    this.page.timeline.addEventListener('phone', () => this.#showUnit());
    byId('track').addEventListener('dblclick', (event) => this.#retypeAt(event));
    byId('phones').addEventListener('keydown', (event) => this.#borderKey(event), true);
    addEventListener('keydown', (event) => {
      if (!(event.ctrlKey || event.metaKey) || event.target instanceof HTMLInputElement) return;
      const key = event.key.toLowerCase();
      if (key !== 'z' && key !== 'y') return;
      event.preventDefault();
      if (key === 'y' || event.shiftKey) this.edits.redo();
      else this.edits.undo();
    });
    this.served.addEventListener('served', ({ detail: keep }) => {
      if (keep) this.#restore(keep);
      this.#refresh();
    });
    this.served.addEventListener('failed', ({ detail }) => this.#say(detail));
    addEventListener('beforeunload', (event) => {
      if (this.edits.isChanged && !this.isApplying && !this.served.isThere) event.preventDefault();
    });
  }

  setOpen(on) {
    this.isOpen = on;
    this.tracks.isOpen = on;
    byId('edit').setAttribute('aria-pressed', on);
    document.body.classList.toggle('editing', on);
    for (const id of ['editor', 'edit-tracks', 'spectrum']) byId(id).hidden = !on;
    this.#draw();
    this.#showUnit();
  }

  /** The face as it is with the edits; called once it is there. */
  setFace(tracks) {
    this.engine = null;
    this.preview = new Preview(this.data, tracks);
    this.markers = this.page.controlPoints.control.positions;
    this.#refresh();
    Engine.start().then((engine) => {
      if (!engine) return;
      this.engine = engine;
      this.#refresh();
    }, (error) => this.#say(`This page cannot make the line again by itself: ${error.message}`));
  }

  /** Shows the edits on the face: all but words with the engine, once it comes to it; else as far as the page knows. */
  #show() {
    const wanted = JSON.stringify(this.edits.list);
    if (!this.engine || !this.edits.isChanged) {
      this.made = null;
      this.page.controlPoints.control.positions = this.markers;
      return this.preview.show(this.edits);
    }
    if (this.made?.edits === wanted || this.isMaking) return;
    this.isMaking = true;
    setTimeout(() => {
      this.isMaking = false;
      this.#make();
      this.#refresh();
    });
  }

  #make() {
    if (!this.edits.isChanged) return;
    this.made = { edits: JSON.stringify(this.edits.list), fits: false };
    try {
      const { frames, weights, markers, warnings } = this.engine.render(this.edits.list);
      this.made = { ...this.made, warnings, fits: this.preview.take(frames, weights) };
      if (this.made.fits && markers.length === this.markers.length) this.page.controlPoints.control.positions = markers;
    } catch (error) {
      this.made.warnings = error.message;
    }
    if (!this.made.fits) this.preview.show(this.edits);
  }

  #draw() {
    if (!this.isOpen) return;
    this.tracks.draw();
    const canvas = byId('spectrum');
    const color = matchMedia('(prefers-color-scheme: dark)').matches ? [236, 234, 230] : [29, 31, 35];
    drawSpectrogram(canvas, SPECTRUM_HEIGHT, { sound: this.data.sound, ...this.page.timeline.window, color });
  }

  #refresh() {
    const { edits } = this;
    byId('undo').disabled = edits.past.length === 0;
    byId('redo').disabled = edits.future.length === 0;
    byId('save-edits').disabled = edits.list.length === 0;
    byId('apply').hidden = !this.served.isThere;
    byId('apply').disabled = !edits.isChanged || this.isApplying;
    const waiting = edits.list.filter((edit) => !edits.applied.some((one) => JSON.stringify(one) === JSON.stringify(edit)) && !(this.engine && this.made?.fits !== false ? isMadeHere : isShownAtOnce)(edit)).length;
    byId('edit-state').textContent = !edits.list.length ? 'Nothing changed yet.'
      : waiting ? `${waiting} change${waiting === 1 ? '' : 's'} will be seen when the line is made again.` : 'What you see has all your changes.';
    byId('edit-list').replaceChildren(...edits.list.map((edit, index) => {
      const item = document.createElement('li');
      item.append(toldOf(edit), button('×', () => edits.remove(index), `Take back: ${toldOf(edit)}`));
      item.lastChild.setAttribute('aria-label', `Take back: ${toldOf(edit)}`);
      return item;
    }));
    const doubts = this.made?.warnings?.trim().split('\n').join('; ');
    byId('edit-help').textContent = doubts ? `${doubts}.` : this.served.isThere ? '' : 'Save the edits and make the line with them: synth … --edits edits.json';
    this.#placeBorders();
    if (this.preview) {
      this.#show();
      this.page.stage.setTime(this.page.clock.time);
    }
  }

  #say(text) {
    this.isApplying = false;
    byId('edit-trouble').textContent = text;
    byId('edit-trouble').hidden = !text;
    this.#refresh();
  }

  #save() {
    const link = document.createElement('a');
    link.href = URL.createObjectURL(new Blob([`${JSON.stringify(this.edits.list, null, 1)}\n`], { type: 'application/json' }));
    link.download = 'edits.json';
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  #apply() {
    this.isApplying = true;
    this.#say('');
    this.isApplying = true;
    byId('edit-state').textContent = 'The line is being made again …';
    byId('apply').disabled = true;
    const { timeline, clock } = this.page;
    this.served.apply(this.edits.list, {
      past: this.edits.past, future: this.edits.future, time: clock.time, zoom: timeline.pixelsPerSecond, scroll: timeline.scroller.scrollLeft,
      isOpen: this.isOpen, tracks: this.tracks.shown.map(({ name }) => name),
    });
  }

  #restore(keep) {
    this.edits.restore({ list: this.edits.list, past: keep.past ?? [], future: keep.future ?? [] });
    for (const { name } of [...this.tracks.shown]) this.tracks.toggle(name);
    const known = [...this.tracks.chooser.options].map(({ value }) => value);
    for (const name of keep.tracks ?? []) if (known.includes(name)) this.tracks.toggle(name);
    this.page.timeline.pixelsPerSecond = keep.zoom;
    this.page.timeline.layout();
    this.page.timeline.scroller.scrollLeft = keep.scroll;
    this.page.clock.seek(Math.min(keep.time, this.page.clock.duration));
    this.setOpen(Boolean(keep.isOpen));
  }

  // Words.

  #retypeAt(event) {
    const word = document.elementsFromPoint(event.clientX, event.clientY).find((one) => one.classList?.contains('word'));
    if (word && this.isOpen) this.#retype(word);
  }

  #retype(place) {
    const before = place.textContent;
    const input = document.createElement('input');
    input.className = 'retype';
    input.value = before;
    input.setAttribute('aria-label', `The word ${before}`);
    const number = [...byId('words').children].filter((one) => one.textContent.toLowerCase() === before.toLowerCase()).indexOf(place);
    let isDone = false;
    const finish = (isKept) => {
      if (isDone) return;
      isDone = true;
      const after = input.value.trim();
      place.textContent = isKept ? after : before;
      place.classList.toggle('changed', isKept && after !== before);
      if (isKept && after !== before) this.edits.retype(before, Math.max(0, number), after);
    };
    input.addEventListener('keydown', (event) => {
      event.stopPropagation();
      if (event.key === 'Enter') finish(true);
      if (event.key === 'Escape') finish(false);
    });
    input.addEventListener('blur', () => finish(true));
    input.addEventListener('pointerdown', (event) => event.stopPropagation());
    place.replaceChildren(input);
    input.select();
    input.focus();
  }

  // Borders between phones.

  #addBorders() {
    const { phones } = this.data.report;
    this.borders = phones.slice(1).map((phone, index) => {
      const grip = document.createElement('i');
      grip.className = 'border';
      grip.dataset.border = index + 1;
      grip.title = 'Drag the border between the phones';
      grip.addEventListener('pointerdown', (event) => this.#dragBorder(event, index + 1));
      byId('phones').append(grip);
      return grip;
    });
  }

  /** Where a border stands with the edits. */
  #borderTime(index) {
    const { phones } = this.data.report;
    const own = phones[index].start_s;
    const edit = this.edits.list.find((one) => one.kind === 'border' && one.before === phones[index - 1].phone && one.after === phones[index].phone
      && (Math.abs(one.at_s - own) < 2e-3 || this.edits.applied.some((was) => was.kind === 'border' && was.at_s === one.at_s && was.before === one.before && was.after === one.after && Math.abs(was.to_s - own) < 2e-3)));
    return edit ? edit.to_s : own;
  }

  #placeBorders() {
    const { phones } = this.data.report;
    const share = (time) => `${(100 * time) / this.page.clock.duration}%`;
    const times = [0, ...phones.slice(1).map((_, index) => this.#borderTime(index + 1)), phones[phones.length - 1].end_s];
    this.page.timeline.blocks.forEach((block, index) => {
      block.style.left = share(times[index]);
      block.style.width = share(times[index + 1] - times[index]);
    });
    this.borders.forEach((grip, index) => (grip.style.left = share(times[index + 1])));
  }

  #moveBorder(index, time, gesture) {
    const { phones } = this.data.report;
    const least = (index > 1 ? this.#borderTime(index - 1) : 0) + SHORTEST_S;
    const most = (index + 1 < phones.length ? this.#borderTime(index + 1) : phones[index].end_s) - SHORTEST_S;
    this.edits.moveBorder(phones[index - 1].phone, phones[index].phone, this.#borderTime(index), Math.round(1e4 * Math.min(Math.max(time, least), most)) / 1e4, gesture);
  }

  #dragBorder(event, index) {
    if (event.button !== 0) return;
    event.stopPropagation();
    const grip = event.target;
    grip.setPointerCapture(event.pointerId);
    const gesture = `border ${index} ${event.timeStamp}`;
    const move = ({ clientX }) => this.#moveBorder(index, this.page.timeline.timeOf(clientX), gesture);
    const end = () => {
      grip.removeEventListener('pointermove', move);
      this.edits.settle();
    };
    grip.addEventListener('pointermove', move);
    grip.addEventListener('pointerup', end, { once: true });
    grip.addEventListener('pointercancel', end, { once: true });
  }

  /** Alt and an arrow move the beginning of the phone that has the focus. */
  #borderKey(event) {
    const index = Number(event.target.dataset?.phone);
    if (!this.isOpen || !event.altKey || !(index > 0) || !/^Arrow(Left|Right)$/.test(event.key)) return;
    event.preventDefault();
    event.stopPropagation();
    this.#moveBorder(index, this.#borderTime(index) + (event.key === 'ArrowLeft' ? -BORDER_STEP_S : BORDER_STEP_S), null);
  }

  // Units.

  #showUnit() {
    const place = byId('edit-unit');
    const phone = this.page.timeline.current;
    if (!this.isOpen || phone === undefined || phone < 0) return place.replaceChildren();
    const { report, editing } = this.data;
    const number = report.units.findIndex(({ first, last }) => first <= phone && phone <= last);
    if (number < 0) return place.replaceChildren();
    const unit = report.units[number];
    const names = (first, last) => report.phones.slice(first, last + 1).map((one) => one.phone);
    const told = document.createElement('span');
    told.textContent = `${names(unit.first, unit.last).join(' ')} from ${nameOf(unit.take)}`;
    const actions = [];
    if (unit.take && this.served.isThere) actions.push(button('See and hear the source', () => this.served.showSource(number, unit.source_start_s)));
    const offers = (editing?.offers?.[number] ?? []).filter(({ first, last }) => first <= phone && phone <= last);
    if (offers.length) {
      const choose = document.createElement('select');
      choose.setAttribute('aria-label', 'Take it from elsewhere');
      choose.append(new Option('Take it from …', ''));
      offers.forEach((offer, index) => choose.append(new Option(`${index === 0 ? 'the next best: ' : ''}${offer.take}, ${names(offer.first, offer.last).join(' ')} (cost ${offer.cost.toFixed(2)})`, index)));
      choose.addEventListener('change', () => {
        const offer = offers[choose.value];
        if (offer) this.edits.takeUnit(names(offer.first, offer.last), report.phones[offer.first].start_s, offer.take, offer.source_start_s);
      });
      choose.id = 'offers';
      actions.push(choose);
    }
    if (unit.take) actions.push(button('Draw it with curves', () => this.edits.drawWithCurves(names(unit.first, unit.last), report.phones[unit.first].start_s)));
    return place.replaceChildren(told, ...actions);
  }
}
