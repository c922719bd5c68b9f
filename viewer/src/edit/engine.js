// The line made again in the page by the program's own code as WebAssembly (src/page_engine), where synth has put it in.
import { readEngine } from '../page_data.js';

const NO_SUCH_FILE = 8;
/** All that the WebAssembly asks of its surroundings: no variables, a clock that stands, and no files. */
const NOTHING = new Proxy({}, { get: (_, name) => () => {
  if (name === 'proc_exit') throw new Error('the engine stopped');
  return /^(environ|clock)_/.test(name) ? 0 : NO_SUCH_FILE;
} });

export class Engine {
  /** Null where the page has none. */
  static async start() {
    const given = await readEngine();
    if (!given) return null;
    const module = await WebAssembly.compile(given.code);
    const surroundings = Object.fromEntries(WebAssembly.Module.imports(module).map((one) => [one.module, NOTHING]));
    const { exports } = await WebAssembly.instantiate(module, surroundings);
    exports._initialize();
    return new Engine(exports, given.line);
  }

  constructor(exports, line) {
    this.exports = exports;
    this.#hand(line);
    if (!exports.open()) throw new Error(this.#told());
  }

  #hand(bytes) {
    const at = this.exports.room(bytes.length);
    new Uint8Array(this.exports.memory.buffer, at, bytes.length).set(bytes);
  }

  #told() {
    const { memory, result, resultBytes } = this.exports;
    return new TextDecoder().decode(new Uint8Array(memory.buffer, result(), resultBytes()));
  }

  #floats() {
    const { memory, result, resultBytes } = this.exports;
    return new Float32Array(memory.buffer, result(), resultBytes() / 4).slice();
  }

  /** The line with these edits, all but those of words: {frames, weights, markers, warnings}. Throws where one cannot be. */
  render(edits) {
    this.#hand(new TextEncoder().encode(JSON.stringify(edits)));
    const frames = this.exports.render();
    if (!frames) throw new Error(this.#told());
    this.exports.weights();
    const weights = this.#floats();
    this.exports.markers();
    const markers = this.#floats();
    this.exports.warnings();
    return { frames, weights, markers, warnings: this.#told() };
  }

  /** Every vertex of a frame of the line that was made last, x y z side by side, in the mesh's unit. */
  vertices(frame) {
    if (!this.exports.vertices(frame)) throw new Error(this.#told());
    return this.#floats();
  }
}

/** Whether the engine makes a line with this edit; a word has to be spoken again. */
export const isMadeHere = (edit) => edit.kind !== 'word';
