// The sound is the clock: everything shown follows the audio element's time.

/** Between its updates the element's time stands still for a few milliseconds; then we go on by ourselves, so far. */
const LONGEST_GUESS_S = 0.06;

export class SoundClock extends EventTarget {
  constructor(wav, duration) {
    super();
    this.duration = duration;
    this.audio = new Audio(URL.createObjectURL(new Blob([wav], { type: 'audio/wav' })));
    this.audio.preload = 'auto';
    this.heard = { time: 0, at: 0 };
    this.told = 0;
    for (const name of ['play', 'pause', 'ratechange', 'seeked', 'ended']) {
      this.audio.addEventListener(name, () => this.dispatchEvent(new Event('change')));
    }
  }

  get playing() {
    return !this.audio.paused && !this.audio.ended;
  }

  get time() {
    const time = this.audio.currentTime;
    if (!this.playing) return Math.min(time, this.duration);
    const now = performance.now() / 1000;
    if (time !== this.heard.time) this.heard = { time, at: now };
    const since = Math.min((now - this.heard.at) * this.audio.playbackRate, LONGEST_GUESS_S);
    const guess = Math.min(this.heard.time + since, this.duration);
    // The element may have got less far than was guessed: then we wait for it; further back is another place.
    if (guess > this.told || guess < this.told - LONGEST_GUESS_S) this.told = guess;
    return this.told;
  }

  get speed() {
    return this.audio.playbackRate;
  }

  set speed(rate) {
    this.audio.playbackRate = rate;
  }

  get loop() {
    return this.audio.loop;
  }

  /** The element begins again by itself: where it ended and told so first, a pause between the two was lost. */
  set loop(on) {
    this.audio.loop = on;
  }

  /** 0 to 1. */
  get volume() {
    return this.audio.volume;
  }

  set volume(share) {
    this.audio.volume = share;
  }

  async play() {
    if (this.audio.currentTime >= this.duration - 0.01) this.audio.currentTime = 0;
    await this.#start();
  }

  pause() {
    this.audio.pause();
  }

  toggle() {
    return this.playing ? this.pause() : this.play();
  }

  seek(time) {
    const target = Math.min(Math.max(time, 0), this.duration);
    this.heard = { time: target, at: performance.now() / 1000 };
    this.told = target;
    this.audio.currentTime = target;
    this.dispatchEvent(new Event('change'));
  }

  /** Pausing before the first sound came out breaks off the start; that is what was asked for. */
  async #start() {
    try {
      await this.audio.play();
    } catch (error) {
      if (error.name !== 'AbortError') throw error;
    }
  }
}
