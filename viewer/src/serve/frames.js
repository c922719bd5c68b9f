// The page of the line that is shown, and beside it the take that a unit came from. Pages have no network of their own:
// what they want of the server they say here.
import { address } from './api.js';

export class Frames {
  /** onMessage(message): what the shown line's page wants. */
  constructor(onMessage) {
    this.place = document.getElementById('frames');
    this.onMessage = onMessage;
    addEventListener('message', (event) => this.#heard(event));
  }

  /** `keep`: what the page said of itself before, to be given back to the new one. */
  show(line, keep) {
    this.line = line.line;
    this.version = line.version;
    this.keep = keep;
    this.page = document.createElement('iframe');
    this.page.title = `The face says: ${line.title}`;
    this.page.allow = 'autoplay';
    this.page.src = address('/page', { line: line.line, version: line.version });
    this.beside = null;
    this.place.replaceChildren(this.page);
  }

  showSource(unit, start) {
    this.beside?.remove();
    this.beside = document.createElement('section');
    this.beside.className = 'beside';
    const head = document.createElement('p');
    head.append('Where it was taken from');
    const close = document.createElement('button');
    close.type = 'button';
    close.className = 'plain';
    close.textContent = 'Close';
    close.addEventListener('click', () => this.beside.remove());
    head.append(close);
    const frame = document.createElement('iframe');
    frame.title = 'The captured take';
    frame.allow = 'autoplay';
    frame.src = `${address('/source', { line: this.line, unit })}#t=${start}`;
    this.beside.append(head, frame);
    this.place.append(this.beside);
  }

  tell(message) {
    this.page?.contentWindow?.postMessage(message, location.origin);
  }

  #heard(event) {
    if (event.origin !== location.origin || event.source !== this.page?.contentWindow) return;
    const message = event.data;
    if (message?.mouthpiece === 'ready') this.tell({ mouthpiece: 'served', keep: this.keep ?? null });
    else this.onMessage(message);
  }
}
