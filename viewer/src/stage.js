// The studio: camera, lights and the face that the GLB holds.
import {
  AnimationMixer, Box3, DirectionalLight, Group, HemisphereLight, Matrix3, Matrix4, NeutralToneMapping, PCFShadowMap,
  PerspectiveCamera, PMREMGenerator, Scene, SRGBColorSpace, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { RoomEnvironment } from 'three/addons/environments/RoomEnvironment.js';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { MeshoptDecoder } from 'three/addons/libs/meshopt_decoder.module.js';
import { materialFor } from './materials.js';

const FIELD_OF_VIEW_DEG = 24;
/** Pixels along an edge of the cube of light around the face. */
const ENVIRONMENT_SIZE = 64;
/** Share of a turn's rest that each picture takes where 60 are drawn a second. */
const DAMPING = 0.12;
/** A little from the side: a face seen square on looks flat. */
const VIEW_DIRECTION = new Vector3(0.3, 0.06, 1).normalize();

/**
 * Shares of the full resolution to move at, best first, and how long to stand still before the best is drawn: where it
 * takes long, a person is to have stopped. The last ones keep the shadows of the picture before them.
 */
const QUALITIES = [
  { share: 1, shadows: true, still_ms: 250 },
  { share: 0.7, shadows: true, still_ms: 250 },
  { share: 0.5, shadows: false, still_ms: 400 },
  { share: 0.34, shadows: false, still_ms: 400 },
];
const SLOW_FRAME_MS = 70;
const VERY_SLOW_FRAME_MS = 200;
const SLOW_FRAMES_TO_STEP_DOWN = 2;
const LONGEST_FRAME_MS = 2000;

/** No graphics card draws, but the processor. */
function isDrawnInSoftware(gl) {
  const told = gl.getExtension('WEBGL_debug_renderer_info');
  return /swiftshader|llvmpipe|softpipe|basic render/i.test(gl.getParameter(told ? told.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
}

/**
 * Stands in for three's reader of KTX2, whose transcoder runs in a worker, which the page's policy forbids: the picture that
 * other readers get, or none. Each texture without one is told to `unseen`.
 */
const pictureForKtx2 = (unseen) => ({ json }) => ({
  name: 'KHR_texture_basisu',
  loadTexture(index) {
    const { source, extensions = {} } = json.textures[index];
    if (source !== undefined || !extensions.KHR_texture_basisu || extensions.EXT_texture_webp) return null;
    unseen.add(index);
    return Promise.resolve(null);
  },
});

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true });
    this.renderer.outputColorSpace = SRGBColorSpace;
    this.renderer.toneMapping = NeutralToneMapping;
    this.renderer.toneMappingExposure = 1.0;
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFShadowMap;
    this.renderer.shadowMap.autoUpdate = false;
    this.scene = new Scene();
    this.camera = new PerspectiveCamera(FIELD_OF_VIEW_DEG, 1, 0.01, 20);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.enablePan = false;
    this.controls.addEventListener('change', () => this.invalidate());
    this.meshes = [];
    this.unseenTextures = new Set();
    this.needsRender = true;
    this.quality = isDrawnInSoftware(this.renderer.getContext()) ? QUALITIES.length - 1 : 0;
    this.slowFrames = 0;
    new ResizeObserver(() => this.#resize()).observe(canvas.parentElement);
  }

  /**
   * Parses the GLB; `parts` tell each material's kind, `focus` the box of what to look at (null: the whole), `placing`
   * (3 x 3, column by column) takes the GLB's scene to where `focus` is.
   */
  async load(glb, parts, focus, placing) {
    const loader = new GLTFLoader().setMeshoptDecoder(MeshoptDecoder).register(pictureForKtx2(this.unseenTextures));
    const gltf = await loader.parseAsync(glb.buffer.slice(glb.byteOffset, glb.byteOffset + glb.byteLength), '');
    this.face = gltf.scene;
    gltf.scene.traverse((object) => {
      if (!object.isMesh) return;
      const number = gltf.parser.associations.get(object.material)?.materials;
      // A head that came as GLB has more materials than parts, and in another order.
      const part = parts.find(({ material }) => material >= 0 && material === number) ?? parts[number];
      this.#dress(object, part?.kind);
    });
    const placed = new Group();
    placed.applyMatrix4(new Matrix4().setFromMatrix3(new Matrix3().fromArray(placing)));
    this.scene.add(placed.add(this.face));
    placed.updateMatrixWorld(true);  // a packed face is in units of its own, and is measured before it is drawn
    this.mixer = new AnimationMixer(this.face);
    this.clip = gltf.animations.find(({ name }) => name === 'speech') ?? gltf.animations[0];
    this.#forgetStillParts();
    if (this.clip) this.mixer.clipAction(this.clip).play();
    this.focus = focus ?? new Box3().setFromObject(this.face);
    this.#light();
    this.#resize();  // not first drawn in another size: where no graphics card draws, a picture takes a second
    this.resetView();
    this.setTime(0);
  }

  #dress(mesh, kind) {
    mesh.material = materialFor(kind, mesh.material);
    mesh.castShadow = true;
    mesh.receiveShadow = true;
    mesh.frustumCulled = false;  // its box is that of the rest pose
    mesh.userData.kind = kind;
    this.meshes.push(mesh);
  }

  /** Parts that no shape moves (hair, eyes) are not worth adding up dozens of zeros for every vertex and picture. */
  #forgetStillParts() {
    for (const mesh of this.meshes) {
      const targets = mesh.geometry.morphAttributes.position ?? [];
      if (targets.some(({ array }) => array.some((value) => value !== 0))) continue;
      mesh.geometry.morphAttributes = {};
      mesh.morphTargetInfluences = undefined;
      const own = `${mesh.name}.morphTargetInfluences`;
      if (this.clip) this.clip.tracks = this.clip.tracks.filter((track) => track.name !== own);
    }
  }

  #light() {
    const center = this.focus.getCenter(new Vector3());
    const radius = this.focus.getSize(new Vector3()).length() / 2;
    const add = (color, intensity, x, y, z) => {
      const light = new DirectionalLight(color, intensity);
      light.position.set(x, y, z).normalize().multiplyScalar(5 * radius).add(center);
      light.target.position.copy(center);
      this.scene.add(light, light.target);
      return light;
    };
    const key = add(0xfff1e2, 2.1, -0.75, 0.85, 1);
    add(0xdfe9ff, 0.55, 1, 0.1, 0.9);
    add(0xe9f1ff, 1.7, 0.9, 0.7, -0.9);
    add(0xffe2d0, 0.7, -1, 0.2, -0.6);
    this.scene.add(new HemisphereLight(0xffffff, 0x9a8278, 0.5));

    this.key = key;
    key.castShadow = true;
    key.shadow.mapSize.set(2048, 2048);
    key.shadow.radius = 5;
    key.shadow.normalBias = 0.012 * radius;
    key.shadow.bias = -0.0006;
    Object.assign(key.shadow.camera, { left: -1.6 * radius, right: 1.6 * radius, top: 1.6 * radius, bottom: -1.6 * radius, near: 2 * radius, far: 8 * radius });

    const generator = new PMREMGenerator(this.renderer);
    // three makes no less than 256 of it: seconds where no graphics card draws, for light that looks the same on a face.
    generator._setSize = (size) => { generator._cubeSize = size; };
    this.scene.environment = generator.fromScene(new RoomEnvironment(), 0.06, 0.1, 100, { size: ENVIRONMENT_SIZE }).texture;
    this.scene.environmentIntensity = 0.32;
    generator.dispose();
  }

  /** `direction`: from the face to the camera; `share`: of the usual distance. */
  resetView(direction = VIEW_DIRECTION, share = 1) {
    const center = this.focus.getCenter(new Vector3());
    const size = this.focus.getSize(new Vector3());
    const vertical = (FIELD_OF_VIEW_DEG * Math.PI) / 360;
    const horizontal = Math.atan(Math.tan(vertical) * this.camera.aspect);
    const distance = 1.22 * Math.max(size.y / 2 / Math.tan(vertical), size.x / 2 / Math.tan(horizontal)) + size.z / 2;
    this.camera.position.copy(direction).normalize().multiplyScalar(share * distance).add(center);
    this.camera.near = distance / 50;
    this.camera.far = distance * 20;
    this.camera.updateProjectionMatrix();
    this.controls.target.copy(center);
    this.controls.minDistance = distance / 5;
    this.controls.maxDistance = distance * 4;
    this.controls.update();
    this.invalidate();
  }

  /** The weights of the shapes over time; other values may be written into them. */
  get weightTracks() {
    return this.clip?.tracks.filter(({ name }) => name.endsWith('.morphTargetInfluences')) ?? [];
  }

  setTime(time) {
    if (this.clip) this.mixer.setTime(Math.min(Math.max(time, 0), this.clip.duration - 1e-5));
    this.invalidate();
  }

  setWireframe(on) {
    this.isWireframe = on;
    for (const mesh of this.meshes) mesh.material.wireframe = on;
    this.invalidate();
  }

  invalidate() {
    this.needsRender = true;
  }

  /** Draws when something changed: quickly while it moves, at full quality when it stands still. */
  render() {
    const now = performance.now();
    // A turn's rest is over in the same time however few pictures are drawn.
    this.controls.dampingFactor = 1 - (1 - DAMPING) ** ((60 * (now - (this.lookedAt ?? now))) / 1000);
    this.lookedAt = now;
    this.controls.update();
    if (this.needsRender) {
      this.needsRender = false;
      this.#watchSpeed(now);
      this.#draw(QUALITIES[this.quality]);
      this.drawnAt = now;
      this.isRough = this.quality > 0;
    } else if (this.isRough && now - this.drawnAt > QUALITIES[this.quality].still_ms) {
      this.isRough = false;
      this.#draw(QUALITIES[0]);
    }
  }

  #watchSpeed(now) {
    const frameTime = now - (this.drawnAt ?? -Infinity);
    if (frameTime > LONGEST_FRAME_MS) return;  // a pause, no slow frame
    this.slowFrames = frameTime > SLOW_FRAME_MS ? this.slowFrames + 1 : 0;
    if (this.slowFrames < SLOW_FRAMES_TO_STEP_DOWN || this.quality === QUALITIES.length - 1) return;
    this.quality = Math.min(this.quality + (frameTime > VERY_SLOW_FRAME_MS ? 2 : 1), QUALITIES.length - 1);
    this.slowFrames = 0;
  }

  #draw({ share, shadows }) {
    const ratio = share * Math.min(window.devicePixelRatio, 2);
    if (this.renderer.getPixelRatio() !== ratio) this.renderer.setPixelRatio(ratio);
    this.renderer.shadowMap.needsUpdate = !this.key?.shadow.map || (shadows && !this.isWireframe);
    this.renderer.render(this.scene, this.camera);
  }

  #resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (width === 0 || height === 0 || (width === this.width && height === this.height)) return;
    Object.assign(this, { width, height });
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }
}
