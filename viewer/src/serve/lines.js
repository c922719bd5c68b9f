// The list of lines and how far each is.

function element(name, className, text = '') {
  const made = document.createElement(name);
  made.className = className;
  made.textContent = text;  // text from outside never becomes markup
  return made;
}

function howOf(line) {
  if (line.state === 'working') return `${line.stage || 'beginning'} …`;
  if (line.state === 'waiting') return 'waits for its turn';
  if (line.state === 'failed') return line.error;
  if (line.state === 'stopped') return 'stopped';
  if (line.is_head) return 'is a face now';
  const counted = (many, what) => (many ? `, ${many} ${what}${many === 1 ? '' : 's'}` : '');
  const doubts = line.warnings.length ? `${counted(line.warnings.length, 'thing')} to look at` : counted(line.notices.length, 'note');
  return `${line.duration_s.toFixed(1)} s${line.version > 1 ? `, changed ${line.version - 1}×` : ''}${doubts}`;
}

export class Lines {
  /** actions: {open(line), stop(line)}. */
  constructor(actions) {
    this.actions = actions;
    this.place = document.getElementById('lines');
    this.spoken = document.getElementById('spoken');
    this.told = '';
    this.states = new Map();
  }

  show(state, current) {
    document.getElementById('folder').textContent = state.folder;
    document.getElementById('empty').hidden = state.lines.length > 0;
    const told = JSON.stringify([state.lines, current]);
    if (told === this.told) return;
    this.told = told;
    const focused = document.activeElement?.dataset?.line;
    this.place.replaceChildren(...[...state.lines].reverse().map((line) => this.#item(line, current)));
    if (focused !== undefined) this.place.querySelector(`[data-line="${focused}"]`)?.focus();
    for (const line of state.lines) this.#announce(line);
  }

  #item(line, current) {
    const item = element('li', '');
    item.setAttribute('aria-current', line.line === current);
    const open = element('button', 'open', line.title);
    open.type = 'button';
    open.dataset.line = line.line;
    open.disabled = line.is_head || line.version === 0;
    open.addEventListener('click', () => this.actions.open(line.line));
    item.append(open);
    const isBusy = line.state === 'working' || line.state === 'waiting';
    if (isBusy) {
      const stop = element('button', 'plain', 'Stop');
      stop.type = 'button';
      stop.addEventListener('click', () => this.actions.stop(line.line));
      item.append(stop);
    }
    item.append(element('span', `how${line.state === 'failed' ? ' failed' : ''}${line.state === 'working' ? ' busy' : ''}`, howOf(line)));
    return item;
  }

  /** A screen reader is told once when a line is done or has failed. */
  #announce(line) {
    const before = this.states.get(line.line);
    this.states.set(line.line, line.state);
    if (before === undefined || before === line.state || !['done', 'failed'].includes(line.state)) return;
    this.spoken.textContent = line.state === 'done' ? `${line.title}: done` : `${line.title}: ${line.error}`;
  }
}
