// Words, phones coloured by take, joins, curves and the playhead; a click or a drag goes there.
import { drawCurves, loudestOf } from './curves.js';
import { wordsOf } from './panels.js';
import { nameOf } from './takes.js';

const USUAL_PIXELS_PER_SECOND = 110;
const MOST_PIXELS_PER_SECOND = 2400;
const CURVES_HEIGHT = 64;
const SOURCES = ['prediction', 'capture', 'contact', 'curves'];

function element(name, className, text = '') {
  const made = document.createElement(name);
  made.className = className;
  made.textContent = text;  // text from outside never becomes markup
  return made;
}

function seconds(value) {
  return `${value.toFixed(2)} s`;
}

/** Events: "layout" when the window of time has changed, "phone" when another phone is the current one. */
export class Timeline extends EventTarget {
  constructor(data, takes, clock) {
    super();
    this.data = data;
    this.takes = takes;
    this.clock = clock;
    this.pixelsPerSecond = USUAL_PIXELS_PER_SECOND;
    this.loudest = loudestOf(data.sound.samples);
    for (const id of ['scroller', 'track', 'words', 'phones', 'joins', 'sources', 'curves', 'playhead', 'now', 'tooltip']) {
      this[id] = document.getElementById(id);
    }
    this.#addWords();
    this.#addPhones();
    this.#addJoins();
    this.#addSources();
    this.#listen();
    new ResizeObserver(() => this.layout()).observe(this.scroller);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.layout());
    this.layout();
  }

  #place(made, start, end, parent) {
    made.style.left = `${(100 * start) / this.clock.duration}%`;
    made.style.width = `${(100 * (end - start)) / this.clock.duration}%`;
    parent.append(made);
    return made;
  }

  #addWords() {
    for (const { text, start, end } of wordsOf(this.data.report)) this.#place(element('span', 'word', text), start, end, this.words);
  }

  #addPhones() {
    this.blocks = this.data.report.phones.map((phone, index) => {
      const block = element('span', 'phone', phone.phone === 'sil' ? '' : phone.phone);
      block.dataset.phone = index;
      block.style.background = this.takes.backgroundOf(index);
      block.classList.toggle('silence', phone.phone === 'sil');
      block.classList.toggle('backoff', phone.from === 'backoff');
      block.setAttribute('role', 'option');
      block.setAttribute('aria-label', this.#spokenOf(index));
      block.tabIndex = -1;
      return this.#place(block, phone.start_s, phone.end_s, this.phones);
    });
  }

  #addJoins() {
    this.data.report.joins.forEach((join, index) => {
      const tick = this.#place(element('span', 'join'), join.time_s, join.time_s, this.joins);
      tick.dataset.join = index;
    });
  }

  /** Of each second, what moved the lips, as parts of a bar. */
  #addSources() {
    const seconds = this.data.report.moved_by?.seconds ?? [];
    seconds.forEach((second, index) => {
      const end = seconds[index + 1]?.start_s ?? this.clock.duration;
      const bar = this.#place(element('span', 'source-bar'), second.start_s, end, this.sources);
      for (const part of SOURCES) {
        const piece = element('i', `source-${part}`);
        piece.style.width = `${100 * second[part]}%`;
        piece.dataset.source = index;
        bar.append(piece);
      }
    });
  }

  /** `factor` times as wide, the middle of what is seen (the playhead, if it is) staying there; 0: the whole line. */
  zoom(factor) {
    const { clientWidth, scrollLeft } = this.scroller;
    const x = (this.clock.time / this.clock.duration) * this.width;
    const at = x >= scrollLeft && x <= scrollLeft + clientWidth ? x - scrollLeft : clientWidth / 2;
    const share = (scrollLeft + at) / this.width;
    const fit = clientWidth / this.clock.duration;
    const now = this.width / this.clock.duration;
    this.pixelsPerSecond = factor === 0 ? fit : Math.min(Math.max(now * factor, fit), Math.max(MOST_PIXELS_PER_SECOND, fit));
    this.layout();
    this.scroller.scrollLeft = share * this.width - at;
  }

  layout() {
    const width = Math.max(this.scroller.clientWidth, Math.ceil(this.clock.duration * this.pixelsPerSecond));
    this.width = width;
    this.track.style.width = `${width}px`;
    this.#drawCurves();
    this.dispatchEvent(new Event('layout'));
    for (const block of this.blocks) block.classList.toggle('narrow', block.clientWidth < 15);
    this.setTime(this.clock.time);
  }

  /** What is in sight alone: the whole of a long line is wider than a canvas can be. */
  get window() {
    const { clientWidth, scrollLeft } = this.scroller;
    const secondsPerPixel = this.clock.duration / this.width;
    return { start: scrollLeft * secondsPerPixel, end: (scrollLeft + clientWidth) * secondsPerPixel, width: clientWidth };
  }

  #drawCurves() {
    const { sound, lip_opening_mm: lipOpening, lip_width_mm: lipWidth, report } = this.data;
    const { start, end, width } = this.window;
    drawCurves(this.curves, width, CURVES_HEIGHT, { sound, loudest: this.loudest, lipOpening, lipWidth, framesPerSecond: report.fps, start, end });
  }

  timeOf(clientX) {
    const box = this.track.getBoundingClientRect();
    return ((clientX - box.left) / box.width) * this.clock.duration;
  }

  #timeAt(event) {
    return this.timeOf(event.clientX);
  }

  #listen() {
    this.track.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      this.track.setPointerCapture(event.pointerId);
      this.dragging = true;
      this.clock.seek(this.#timeAt(event));
    });
    this.track.addEventListener('pointermove', (event) => {
      if (this.dragging) this.clock.seek(this.#timeAt(event));
      this.#showTooltip(event);
    });
    for (const name of ['pointerup', 'pointercancel']) this.track.addEventListener(name, () => (this.dragging = false));
    this.track.addEventListener('pointerleave', () => (this.tooltip.hidden = true));
    this.scroller.addEventListener('scroll', () => {
      this.#drawCurves();
      this.dispatchEvent(new Event('layout'));
    });
    this.scroller.addEventListener('wheel', (event) => {
      if (!event.ctrlKey) return;
      event.preventDefault();
      this.zoom(event.deltaY < 0 ? 1.25 : 0.8);
    }, { passive: false });
    this.phones.addEventListener('keydown', (event) => this.#key(event));
  }

  /** From phone to phone, the face showing the middle of each. */
  #key(event) {
    const from = Number(event.target.dataset.phone);
    const last = this.blocks.length - 1;
    const to = { ArrowLeft: from - 1, ArrowRight: from + 1, Home: 0, End: last, Enter: from }[event.key];
    if (to === undefined || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    const index = Math.min(Math.max(to, 0), last);
    const phone = this.data.report.phones[index];
    this.clock.pause();
    this.clock.seek((phone.start_s + phone.end_s) / 2);
    this.blocks[index].focus();
  }

  #showTooltip(event) {
    const under = document.elementFromPoint(event.clientX, event.clientY);
    const lines = under?.dataset?.join !== undefined ? this.#joinLines(this.data.report.joins[under.dataset.join])
      : under?.dataset?.source !== undefined ? this.#sourceLines(this.data.report.moved_by.seconds[under.dataset.source])
      : under?.dataset?.phone !== undefined ? this.#phoneLines(Number(under.dataset.phone))
      : null;
    this.tooltip.hidden = !lines;
    if (!lines) return;
    this.tooltip.replaceChildren(...lines);
    const { width, height } = this.tooltip.getBoundingClientRect();
    this.tooltip.style.left = `${Math.min(Math.max(event.clientX - width / 2, 8), innerWidth - width - 8)}px`;
    this.tooltip.style.top = `${event.clientY - height - 16}px`;
  }

  #joinLines(join) {
    return [
      element('strong', '', `Join at ${seconds(join.time_s)}`),
      element('span', '', `step ${join.position_jump_mm.toFixed(2)} mm, speed change ${join.velocity_jump_mm_s.toFixed(0)} mm/s`),
    ];
  }

  #sourceLines(second) {
    const parts = SOURCES.filter((part) => second[part] >= 0.005).map((part) => `${part} ${(100 * second[part]).toFixed(0)} %`);
    return [element('strong', '', `Lips moved by, from ${seconds(second.start_s)}`), element('span', '', parts.join(', ') || 'nothing: they rest')];
  }

  #phoneLines(index) {
    const phone = this.data.report.phones[index];
    const head = element('strong', '', `${phone.phone}${phone.word ? ` in “${phone.word}”` : ''}  ${seconds(phone.start_s)} to ${seconds(phone.end_s)}`);
    const units = this.takes.unitsOf(index).map((unit) => {
      const line = element('span', 'unit');
      const swatch = element('i', 'swatch');
      swatch.style.background = this.takes.colorOf(unit.take);
      line.append(swatch, `${nameOf(unit.take)}, ${unit.backoff ? 'back-off' : unit.scale}, cost ${unit.cost.toFixed(2)}`);
      return line;
    });
    return [head, ...units];
  }

  setTime(time) {
    const x = (time / this.clock.duration) * this.width;
    this.playhead.style.transform = `translateX(${x}px)`;
    const index = this.data.report.phones.findIndex((phone) => time < phone.end_s);
    if (index !== this.current) {
      this.#mark(this.blocks[this.current], false);
      this.#mark(this.blocks[index], true);
      this.current = index;
      this.#describe(index);
      this.dispatchEvent(new Event('phone'));
    }
    this.#follow(x);
  }

  /** The Tab key comes to the current phone alone. */
  #mark(block, isCurrent) {
    if (!block) return;
    block.classList.toggle('current', isCurrent);
    block.setAttribute('aria-selected', isCurrent);
    block.tabIndex = isCurrent ? 0 : -1;
  }

  /** A phone as a screen reader says it. */
  #spokenOf(index) {
    const phone = this.data.report.phones[index];
    const takes = this.takes.unitsOf(index).map((unit) => `${nameOf(unit.take)}${unit.backoff ? ', back-off' : ''}`);
    return `${phone.phone === 'sil' ? 'silence' : phone.phone}${phone.word ? ` in ${phone.word}` : ''}, ${seconds(phone.start_s)} to ${seconds(phone.end_s)}${takes.length ? `, from ${takes.join(' and ')}` : ''}`;
  }

  #describe(index) {
    if (index < 0) return this.now.replaceChildren();
    const phone = this.data.report.phones[index];
    const takes = this.takes.unitsOf(index).map((unit) => `${nameOf(unit.take)} (${unit.backoff ? 'back-off' : unit.scale})`);
    this.now.replaceChildren(
      element('b', '', phone.phone === 'sil' ? 'silence' : phone.phone),
      phone.word ? ` in “${phone.word}”, ` : ' ',
      takes.length ? `${this.data.report.method === 'guided' ? 'detail from' : 'from'} ${takes.join(' and ')}` : '',
    );
  }

  /** Keeps the playhead in sight while it moves by itself. */
  #follow(x) {
    if (this.dragging || this.width <= this.scroller.clientWidth) return;
    const { scrollLeft, clientWidth } = this.scroller;
    if (x < scrollLeft + 20 || x > scrollLeft + clientWidth - 60) this.scroller.scrollLeft = x - clientWidth / 4;
  }
}
