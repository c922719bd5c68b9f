// Puts the page together and moves it with the sound.
import { Vector3 } from 'three';
import { SoundClock } from './clock.js';
import { ControlPoints } from './control_points.js';
import { Editor } from './edit/editor.js';
import { LipGauge } from './lip_gauge.js';
import { readPageData } from './page_data.js';
import { Caption, showDoubts, showHeading, showLegend } from './panels.js';
import { PartsList } from './parts_list.js';
import { Stage } from './stage.js';
import { Takes } from './takes.js';
import { Timeline } from './timeline.js';
import { Transport } from './transport.js';

function showNotice(text) {
  const notice = document.getElementById('notice');
  notice.textContent = text;
  notice.hidden = false;
}

function pressed(id, on) {
  document.getElementById(id).setAttribute('aria-pressed', on);
}

class Page {
  constructor(data) {
    const { report } = data;
    this.report = report;
    this.openings = data.lip_opening_mm;
    this.clock = new SoundClock(data.wav, Math.max(data.sound.samples.length / data.sound.sampleRate, 0.01));
    this.controlPoints = new ControlPoints(data.control, report.fps);
    this.takes = new Takes(report);
    showHeading(data);
    this.warnings = report.warnings ?? [];
    this.notices = report.notices ?? [];
    showDoubts(this.warnings, this.notices);
    showLegend(this.takes);
    this.caption = new Caption(report);
    this.timeline = new Timeline(data, this.takes, this.clock);
    this.transport = new Transport(this.clock, {
      toggleWireframe: () => this.setWireframe(!this.wireframe),
      toggleMarkers: () => this.setMarkers(!this.markers),
      toggleParts: () => this.parts?.setOpen(!this.parts.isOpen),
      resetView: () => this.stage?.resetView(),
      zoomIn: () => this.timeline.zoom(1.5),
      zoomOut: () => this.timeline.zoom(1 / 1.5),
      zoomFit: () => this.timeline.zoom(0),
      toggleEditing: () => this.editor.setOpen(!this.editor.isOpen),
    });
    this.editor = new Editor(data, this);
    this.showTime(0);
  }

  async loadFace(data) {
    this.stage = new Stage(document.getElementById('view'));
    const focus = this.controlPoints.box();
    if (focus) focus.expandByScalar(0.05 * focus.max.distanceTo(focus.min));
    await this.stage.load(data.glb, data.parts, focus, data.shown_from_glb);
    if (this.stage.unseenTextures.size > 0) {
      showDoubts([...this.warnings, 'The face has KTX2 textures, which this page cannot show; its GLB keeps them.'], this.notices);
    }
    const box = this.stage.focus;
    this.controlPoints.addTo(this.stage.scene, box.max.distanceTo(box.min));
    this.stage.scene.updateMatrixWorld(true);
    this.parts = new PartsList(this.stage);
    this.gauge = new LipGauge(this.stage.meshes, this.controlPoints);
    this.editor.setFace(this.stage.weightTracks);
    this.showTime(0);
    this.stage.render();
  }

  setWireframe(on) {
    this.wireframe = on;
    pressed('wireframe', on);
    this.stage?.setWireframe(on);
  }

  setMarkers(on) {
    this.markers = on;
    pressed('markers', on);
    if (!this.controlPoints.balls) return;
    this.controlPoints.balls.visible = on;
    this.controlPoints.setTime(this.shown);
    this.stage.invalidate();
  }

  showTime(time) {
    this.shown = time;
    this.transport.setTime(time);
    this.timeline.setTime(time);
    this.caption.setTime(time);
    this.stage?.setTime(time);
    this.controlPoints.setTime(time);
  }

  start() {
    const frame = () => {
      const { time } = this.clock;
      if (time !== this.shown) this.showTime(time);
      this.stage?.render();
      requestAnimationFrame(frame);
    };
    requestAnimationFrame(frame);
  }
}

/** What tests and scripts in the browser's console may use. */
function publish(page, ready) {
  window.mouthpiece = {
    ready,
    report: page.report,
    get frameCount() { return page.report.frames; },
    get shapeCount() { return Math.max(0, ...(page.stage?.meshes ?? []).map((mesh) => mesh.morphTargetInfluences?.length ?? 0)); },
    get duration() { return page.clock.duration; },
    get time() { return page.clock.time; },
    get shownTime() { return page.shown; },
    get playing() { return page.clock.playing; },
    get volume() { return page.clock.volume; },
    get openings() { return page.openings; },
    get edits() { return page.editor.edits.list; },
    /** What makes the line again in this page; null without it. `made`: the edits of the line that it made last, and how it went. */
    get engine() { return page.editor.engine; },
    get made() { return page.editor.made; },
    /** The weights of the face's shapes in a frame, with the edits that the page shows by itself. */
    weights: (frame) => page.stage?.weightTracks.map(({ values, times }) => [...values.slice((frame * values.length) / times.length, ((frame + 1) * values.length) / times.length)]) ?? [],
    play: () => page.clock.play(),
    pause: () => page.clock.pause(),
    seek(time) {
      page.clock.seek(time);
      page.showTime(time);
    },
    setSpeed: (rate) => (page.clock.speed = rate),
    setWireframe: (on) => page.setWireframe(on),
    setMarkers: (on) => page.setMarkers(on),
    /** Looks at the face from the direction (x, y, z), `share` of the usual distance away. */
    setView: (x, y, z, share = 1) => page.stage?.resetView(new Vector3(x, y, z), share),
    /** Millimetres between the lips of the face as it is shown now. */
    lipOpening: () => page.gauge?.opening() ?? NaN,
  };
}

async function begin() {
  try {
    const data = await readPageData();
    const page = new Page(data);
    const ready = page.loadFace(data).catch((error) => {
      showNotice(`The face cannot be shown: ${error.message}. The sound and the timeline still work.`);
      throw error;
    });
    publish(page, ready);
    page.start();
    const start = Number(location.hash.match(/^#t=([\d.]+)$/)?.[1]);
    if (start > 0) page.clock.seek(start);
  } catch (error) {
    showNotice(error.message);
    throw error;
  }
}

begin();
