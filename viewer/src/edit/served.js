// The page within `synth serve`: it has no network of its own, and says to the page around it what it wants.

export class Served extends EventTarget {
  constructor() {
    super();
    this.isThere = false;
    if (window.parent === window || !location.protocol.startsWith('http')) return;
    addEventListener('message', (event) => this.#heard(event));
    this.#say({ mouthpiece: 'ready' });
  }

  #say(message) {
    window.parent.postMessage(message, location.origin);
  }

  /** The line again, with these edits; `keep` comes back to the page that is made of it. */
  apply(edits, keep) {
    this.#say({ mouthpiece: 'apply', edits, keep });
  }

  showSource(unit, start) {
    this.#say({ mouthpiece: 'source', unit, start });
  }

  #heard(event) {
    if (event.source !== window.parent || event.origin !== location.origin) return;
    if (event.data?.mouthpiece === 'served') {
      this.isThere = true;
      this.dispatchEvent(new CustomEvent('served', { detail: event.data.keep }));
    }
    if (event.data?.mouthpiece === 'failed') this.dispatchEvent(new CustomEvent('failed', { detail: String(event.data.error) }));
  }
}
