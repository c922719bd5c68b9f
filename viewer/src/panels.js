// The words around the view: what is said, the facts, the takes, the word being spoken.

function element(name, className, text = '') {
  const made = document.createElement(name);
  made.className = className;
  made.textContent = text;
  return made;
}

export function showHeading(data) {
  const { report } = data;
  document.getElementById('text').textContent = report.text;
  document.title = report.text ? `${report.text} · Mouthpiece` : 'Mouthpiece';
  const share = report.phones.filter((phone) => phone.from === 'backoff').length / Math.max(report.phones.length, 1);
  const facts = [
    ['voice', report.voice],
    ['corpus', report.corpus],
    ['length', `${report.duration_s.toFixed(2)} s at ${report.fps} fps`],
    ['units', `${report.units.length}, ${report.joins.length} joins`],
    ['back-off', share > 0 ? `${(100 * share).toFixed(0)} % of phones` : 'none'],
  ];
  document.getElementById('facts').replaceChildren(
    ...facts.filter(([, value]) => value).map(([name, value]) => {
      const pair = element('div', 'fact');
      pair.append(element('dt', '', name), element('dd', '', value));
      return pair;
    }),
  );
  const openings = data.lip_opening_mm;
  if (openings.length) {
    document.getElementById('lip-scale').textContent = `, ${Math.min(...openings).toFixed(0)} to ${Math.max(...openings).toFixed(0)} mm`;
  }
}

export function showLegend(takes) {
  const items = [...takes.entries.values()].map(({ take, color, units, seconds }) => {
    const item = element('li', 'take');
    const swatch = element('i', 'swatch');
    swatch.style.background = color;
    item.append(swatch, element('span', 'take-name', take), element('span', 'take-share', `${units} ${units === 1 ? 'unit' : 'units'}, ${seconds.toFixed(2)} s`));
    return item;
  });
  document.getElementById('legend').replaceChildren(...items);
}

/** The phrase around the spoken word, that word bright. */
export class Caption {
  static WORDS_AROUND = 4;

  constructor(report) {
    this.place = document.getElementById('caption');
    this.words = [];
    for (const phone of report.phones) {
      const last = this.words[this.words.length - 1];
      if (!phone.word) continue;
      if (last && last.text === phone.word && last.end === phone.start_s) last.end = phone.end_s;
      else this.words.push({ text: phone.word, start: phone.start_s, end: phone.end_s });
    }
  }

  setTime(time) {
    const current = this.words.findIndex((word) => time < word.end);
    const spoken = current >= 0 && this.words[current].start <= time;
    const state = `${current} ${spoken}`;
    if (state === this.state) return;
    this.state = state;
    const group = Math.floor(Math.max(current < 0 ? this.words.length - 1 : current, 0) / (2 * Caption.WORDS_AROUND));
    const first = group * 2 * Caption.WORDS_AROUND;
    const shown = this.words.slice(first, first + 2 * Caption.WORDS_AROUND);
    this.place.replaceChildren(
      ...shown.map((word, i) => element('span', spoken && first + i === current ? 'spoken' : '', word.text)),
    );
  }
}
