// Buttons and keys.

const STEP_S = 0.1;

function isTyping(target) {
  return target instanceof HTMLSelectElement || (target instanceof HTMLInputElement && !['range', 'checkbox'].includes(target.type));
}

/** actions: {toggleWireframe, toggleMarkers, toggleParts, resetView, zoomIn, zoomOut, zoomFit, toggleEditing}. */
export class Transport {
  constructor(clock, actions) {
    this.clock = clock;
    this.actions = actions;
    for (const id of ['play', 'scrub', 'speed', 'loop', 'volume']) this[id] = document.getElementById(id);
    this.readout = document.getElementById('clock');
    this.scrub.max = clock.duration;
    this.play.addEventListener('click', () => clock.toggle());
    this.scrub.addEventListener('input', () => clock.seek(Number(this.scrub.value)));
    this.speed.addEventListener('change', () => (clock.speed = Number(this.speed.value)));
    this.loop.addEventListener('click', () => this.#toggleLoop());
    this.volume.addEventListener('input', () => (clock.volume = Number(this.volume.value)));
    document.getElementById('zoom-in').addEventListener('click', actions.zoomIn);
    document.getElementById('zoom-out').addEventListener('click', actions.zoomOut);
    document.getElementById('zoom-fit').addEventListener('click', actions.zoomFit);
    document.getElementById('wireframe').addEventListener('click', actions.toggleWireframe);
    document.getElementById('markers').addEventListener('click', actions.toggleMarkers);
    document.getElementById('parts').addEventListener('click', actions.toggleParts);
    document.getElementById('reset-view').addEventListener('click', actions.resetView);
    clock.addEventListener('change', () => this.refresh());
    addEventListener('keydown', (event) => this.#key(event));
    this.refresh();
  }

  #toggleLoop() {
    this.clock.loop = !this.clock.loop;
    this.loop.setAttribute('aria-pressed', this.clock.loop);
  }

  #key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || isTyping(event.target)) return;
    const onButton = event.target instanceof HTMLButtonElement || event.target.type === 'checkbox';
    const step = event.shiftKey ? 10 * STEP_S : STEP_S;
    const keys = {
      ' ': () => !onButton && this.clock.toggle(),
      ArrowLeft: () => this.clock.seek(this.clock.time - step),
      ArrowRight: () => this.clock.seek(this.clock.time + step),
      Home: () => this.clock.seek(0),
      End: () => this.clock.seek(this.clock.duration),
      w: this.actions.toggleWireframe,
      m: this.actions.toggleMarkers,
      p: this.actions.toggleParts,
      r: this.actions.resetView,
      l: () => this.#toggleLoop(),
      e: this.actions.toggleEditing,
      '+': this.actions.zoomIn,
      '=': this.actions.zoomIn,
      '-': this.actions.zoomOut,
      0: this.actions.zoomFit,
    };
    const action = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action || (onButton && event.key === ' ')) return;
    event.preventDefault();
    action();
  }

  refresh() {
    const { playing } = this.clock;
    this.play.classList.toggle('playing', playing);
    this.play.setAttribute('aria-label', playing ? 'Pause' : 'Play');
    this.speed.value = this.clock.speed;  // a page's script sets it, too
  }

  setTime(time) {
    this.scrub.value = time;
    this.scrub.style.setProperty('--done', `${(100 * time) / this.clock.duration}%`);
    this.scrub.setAttribute('aria-valuetext', `${time.toFixed(2)} seconds`);
    this.readout.textContent = `${time.toFixed(2)} / ${this.clock.duration.toFixed(2)} s`;
  }
}
