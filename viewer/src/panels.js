// The words around the view: what is said, the facts, the takes, the word being spoken.
import { nameOf } from './takes.js';

function element(name, className, text = '') {
  const made = document.createElement(name);
  made.className = className;
  made.textContent = text;
  return made;
}

function counted(count, noun) {
  return `${count} ${noun}${count === 1 ? '' : 's'}`;
}

export function showHeading(data) {
  const { report } = data;
  document.getElementById('text').textContent = report.text;
  document.title = report.text ? `${report.text} · Mouthpiece` : 'Mouthpiece';
  const share = report.backoff_share;
  const parts = Object.entries(report.moved_by?.line ?? {}).filter(([, part]) => part >= 0.005).sort((a, b) => b[1] - a[1]);
  const facts = [
    ['method', report.method],
    ['lips moved by', parts.map(([name, part]) => `${name} ${(100 * part).toFixed(0)} %`).join(', ')],
    ['voice', report.voice],
    ['corpus', report.corpus],
    ['length', `${report.duration_s.toFixed(2)} s at ${report.fps} fps`],
    ['fragments', `${counted(report.units.length, 'unit')}, ${counted(report.joins.length, 'join')}`],
    ['back-off', share > 0 ? `${(100 * share).toFixed(0)} % of phone pairs` : 'none'],
  ];
  document.getElementById('facts').replaceChildren(
    ...facts.filter(([, value]) => value).map(([name, value]) => {
      const pair = element('div', 'fact');
      pair.append(element('dt', '', name), element('dd', '', value));
      return pair;
    }),
  );
  const openings = data.lip_opening_mm;
  if (openings.length) document.getElementById('lip-scale').textContent = `, up to ${Math.max(...openings).toFixed(0)} mm`;
}

/** What synth doubts, and what it only tells, or nothing at all. */
export function showDoubts(warnings, notices) {
  const place = document.getElementById('doubts');
  place.hidden = warnings.length + notices.length === 0;
  place.querySelector('summary').textContent =
    warnings.length > 0 ? `${counted(warnings.length, 'thing')} to look at` : counted(notices.length, 'note');
  place.querySelector('ul').replaceChildren(
    ...warnings.map((warning) => element('li', '', warning)),
    ...notices.map((notice) => element('li', 'note', notice)),
  );
}

export function showLegend(takes) {
  const items = [...takes.entries.values()].map(({ take, color, units, seconds }) => {
    const item = element('li', 'take');
    const swatch = element('i', 'swatch');
    swatch.style.background = color;
    item.append(swatch, element('span', 'take-name', nameOf(take)), element('span', 'take-share', `${counted(units, 'unit')}, ${seconds.toFixed(2)} s`));
    return item;
  });
  document.getElementById('legend').replaceChildren(...items);
}

/** Words as the report has them: {text, start, end, afterPause}. */
export function wordsOf(report) {
  const words = [];
  let afterPause = true;
  for (const phone of report.phones) {
    const last = words[words.length - 1];
    if (!phone.word) afterPause = true;
    else if (last && !afterPause && last.text === phone.word && !phone.says_again) last.end = phone.end_s;
    else {
      words.push({ text: phone.word, start: phone.start_s, end: phone.end_s, afterPause });
      afterPause = false;
    }
  }
  return words;
}

const LONGEST_PHRASE_WORDS = 9;

/** Words from pause to pause, long stretches cut into equal parts. */
function phrasesOf(words) {
  const phrases = [];
  for (const word of words) {
    if (word.afterPause) phrases.push([]);
    phrases[phrases.length - 1].push(word);
  }
  return phrases.flatMap((phrase) => {
    const parts = Math.ceil(phrase.length / LONGEST_PHRASE_WORDS);
    const size = Math.ceil(phrase.length / parts);
    return Array.from({ length: parts }, (_, part) => phrase.slice(part * size, (part + 1) * size));
  });
}

/** The phrase that is being spoken or comes next, its spoken word bright. */
export class Caption {
  constructor(report) {
    this.place = document.getElementById('caption');
    this.phrases = phrasesOf(wordsOf(report));
  }

  setTime(time) {
    const phrase = this.phrases.find((words) => time < words[words.length - 1].end) ?? this.phrases[this.phrases.length - 1] ?? [];
    const spoken = phrase.find((word) => word.start <= time && time < word.end);
    if (phrase === this.phrase && spoken === this.spoken) return;
    this.phrase = phrase;
    this.spoken = spoken;
    this.place.replaceChildren(...phrase.map((word) => element('span', word === spoken ? 'spoken' : '', word.text)));
  }
}
