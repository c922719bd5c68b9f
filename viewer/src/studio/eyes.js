// Shows the program what the camera sees, a few times a second, and draws what it finds.
import { post } from '../serve/api.js';

const kWidest = 640, kPause = 60, kPauseInTake = 250;  // pixels, ms
const kPausesForALook = 4;  // of a slow machine in a take, which needs its time for the recording; else as long as a look

export class Eyes {
  constructor(video, drawing) {
    this.video = video;
    this.drawing = drawing;
    this.canvas = document.createElement('canvas');
    this.advice = [];
    this.rate = 0;
    this.times = [];
  }

  start(isTaking) {
    const count = (now) => {
      this.times = [...this.times.filter((time) => time > now - 2000), now];
      if (this.times.length > 2) this.rate = (1000 * (this.times.length - 1)) / (now - this.times[0]);
      this.video.requestVideoFrameCallback(count);
    };
    if (this.video.requestVideoFrameCallback) this.video.requestVideoFrameCallback(count);
    const again = async () => {
      const began = performance.now();
      await this.look().catch((error) => { this.advice = [error.message]; });
      const took = performance.now() - began;
      setTimeout(again, isTaking() ? Math.max(kPauseInTake, kPausesForALook * took) : Math.max(kPause, took));
    };
    again();
  }

  async look() {
    const { videoWidth, videoHeight } = this.video;
    if (!videoWidth) return;
    const scale = Math.min(1, kWidest / videoWidth);
    const width = Math.round(videoWidth * scale), height = Math.round(videoHeight * scale);
    Object.assign(this.canvas, { width, height });
    const context = this.canvas.getContext('2d', { willReadFrequently: true });
    context.drawImage(this.video, 0, 0, width, height);
    const found = await post('/look', { width, height }, context.getImageData(0, 0, width, height).data);
    this.advice = found.advice;
    this.draw(found.points, videoWidth, videoHeight);
  }

  draw(points, width, height) {
    Object.assign(this.drawing, { width, height });
    const context = this.drawing.getContext('2d');
    context.fillStyle = '#4ee08a';
    for (const [x, y] of points) {
      context.beginPath();
      context.arc(x * width, y * height, Math.max(1.2, width / 400), 0, 7);
      context.fill();
    }
  }
}
