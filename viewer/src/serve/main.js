// The page of `synth serve`: a form, the list of lines, and the line that is shown.
import { address, post, state as askState } from './api.js';
import { Frames } from './frames.js';
import { Lines } from './lines.js';

const QUICK_MS = 350;
const SLOW_MS = 2500;
const SOUNDS = /\.(wav|flac|ogg|oga|opus|mp3|m4a|aac|webm|aiff?)$/i;
const HEADS = /\.(glb|vrm|obj|ply|off|face|json)$/i;

const byId = (id) => document.getElementById(id);

class Desk {
  constructor() {
    this.recording = '';
    this.open = null;
    this.keep = null;
    this.frames = new Frames((message) => this.#pageSays(message));
    this.lines = new Lines({
      open: (line) => this.#open(line),
      stop: (line) => this.#try(() => post('/cancel', { line })),
    });
    byId('wish').addEventListener('submit', (event) => {
      event.preventDefault();
      this.#try(() => this.#make());
    });
    byId('text').addEventListener('keydown', (event) => {
      if (event.key === 'Enter' && !event.shiftKey && !event.isComposing) {
        event.preventDefault();
        byId('wish').requestSubmit();
      }
    });
    byId('files').addEventListener('change', (event) => {
      this.#take([...event.target.files]);
      event.target.value = '';
    });
    byId('forget').addEventListener('click', () => this.#setRecording(''));
    // Until somebody chooses, the program's own options hold.
    byId('expression').addEventListener('change', () => { this.isChosen = true; });
    this.#listenToDrops();
    this.#poll();
  }

  #listenToDrops() {
    addEventListener('dragover', (event) => {
      event.preventDefault();
      byId('veil').hidden = false;
    });
    addEventListener('dragleave', (event) => {
      if (!event.relatedTarget) byId('veil').hidden = true;
    });
    addEventListener('drop', (event) => {
      event.preventDefault();
      byId('veil').hidden = true;
      this.#take([...event.dataTransfer.files]);
    });
  }

  #complain(text) {
    byId('trouble').textContent = text;
    byId('trouble').hidden = !text;
  }

  async #try(work) {
    this.#complain('');
    try {
      await work();
    } catch (error) {
      this.#complain(error.message);
    }
    await this.#refresh();
  }

  #wish() {
    return { text: byId('text').value.trim(), recording: this.recording, voice: byId('voice').value, face: byId('face').value, language: byId('language').value, ...this.#expression() };
  }

  #expression() {
    if (!this.isChosen) return {};
    return { expression: { upper_face: byId('upper-face').value, gaze: byId('gaze').checked, head_motion: byId('head-motion').checked, mood: byId('mood').value, mood_strength: Number(byId('mood-strength').value) } };
  }

  async #make() {
    const { line } = await post('/line', {}, JSON.stringify(this.#wish()));
    this.wanted = line;
    byId('text').value = '';
    this.#setRecording('');
  }

  #setRecording(name, shown = name) {
    this.recording = name;
    byId('dropped').hidden = !name;
    byId('recording').textContent = shown;
  }

  /** Anchors and a .face come before the mesh that they belong to. */
  #take(files) {
    const order = (file) => (/\.json$/i.test(file.name) ? 0 : /\.face$/i.test(file.name) ? 1 : 2);
    return this.#try(async () => {
      for (const file of files.sort((a, b) => order(a) - order(b))) {
        if (SOUNDS.test(file.name)) {
          const { name } = await post('/recording', { name: file.name }, file);
          this.#setRecording(name, file.name);
        } else if (HEADS.test(file.name)) {
          await post('/head', { name: file.name }, file);
        } else {
          throw new Error(`${file.name} is neither a recording (WAV, FLAC, MP3, OGG, M4A …) nor a head (GLB, VRM, OBJ, PLY, OFF).`);
        }
      }
    });
  }

  async #poll() {
    await this.#refresh();
    const isBusy = this.state?.lines.some(({ state }) => state === 'working' || state === 'waiting');
    setTimeout(() => this.#poll(), isBusy ? QUICK_MS : SLOW_MS);
  }

  async #refresh() {
    try {
      this.state = await askState();
    } catch (error) {
      return this.#complain(error.message);
    }
    this.#offer('voice', this.state.voices.map((name) => [name, name]), this.state.voice);
    this.#offer('face', this.state.faces.map((name) => [name, name]), 'default');
    this.#offer('language', [['', 'the voice’s'], ...this.state.languages.map(({ tag, name }) => [tag, name])], '');
    this.#offer('mood', [['', 'none'], ...this.state.moods.map((name) => [name, name])], '');
    this.#follow();
    this.lines.show(this.state, this.open);
  }

  #offer(id, choices, usual) {
    const select = byId(id);
    const told = JSON.stringify(choices);
    if (select.dataset.told === told) return;
    const known = new Set([...select.options].map(({ value }) => value));
    const fresh = id === 'face' && known.size ? choices.find(([value]) => !known.has(value))?.[0] : undefined;
    const before = fresh ?? (select.dataset.told ? select.value : usual);
    select.replaceChildren(...choices.map(([value, text]) => new Option(text, value)));
    select.value = choices.some(([value]) => value === before) ? before : choices[0]?.[0];
    select.dataset.told = told;
  }

  /** Shows a line that has just been made, or made again. */
  #follow() {
    const wanted = this.state.lines.find(({ line }) => line === this.wanted);
    if (wanted && wanted.state === 'done') {
      this.wanted = undefined;
      this.#open(wanted.line);
    }
    const open = this.state.lines.find(({ line }) => line === this.open);
    if (open && open.state === 'done' && open.version !== this.frames.version) this.#open(open.line, this.keep);
    if (open && open.state === 'failed' && this.changing === open.line) {
      this.changing = undefined;
      this.frames.tell({ mouthpiece: 'failed', error: open.error });
    }
  }

  #open(number, keep = null) {
    const line = this.state.lines.find(({ line: own }) => own === number);
    if (!line || line.version === 0) return;
    this.open = number;
    this.changing = undefined;
    this.frames.show(line, keep);
    byId('bar').hidden = false;
    byId('where').textContent = `Kept in ${line.folder}`;
    byId('downloads').replaceChildren(...this.state.files.map((name) => {
      const link = document.createElement('a');
      link.href = address('/file', { line: number, name });
      link.download = name;
      link.textContent = name;
      return link;
    }));
    this.lines.show(this.state, this.open);
  }

  #pageSays(message) {
    const line = this.state?.lines.find(({ line: own }) => own === this.open);
    if (!line) return;
    if (message?.mouthpiece === 'source') this.frames.showSource(Number(message.unit), Number(message.start));
    if (message?.mouthpiece !== 'apply') return;
    this.keep = message.keep;
    this.changing = line.line;
    const wish = { text: String(message.text ?? line.text), voice: line.voice, face: line.face, language: line.language, edits: JSON.stringify(message.edits), ...(line.expression ? { expression: line.expression } : {}) };
    this.#try(() => post('/change', { line: line.line }, JSON.stringify(wish)).catch((error) => {
      this.frames.tell({ mouthpiece: 'failed', error: error.message });
      throw error;
    }));
  }
}

new Desk();
