/** The canvas: pictures are drawn out of sight, and shown with eye-dome lighting. */

import {
  type Camera,
  Color,
  DepthTexture,
  Mesh,
  NearestFilter,
  OrthographicCamera,
  type PerspectiveCamera,
  PlaneGeometry,
  Scene,
  ShaderMaterial,
  UnsignedIntType,
  Vector2,
  WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { EYE_DOME_FRAGMENT, FEW_RINGS, RINGS, SCREEN_VERTEX } from "./shaders.js";

/** Darkness of an edge, per power of two by which its other side is nearer. */
const EYE_DOME = 18;

export class Screen {
  private readonly renderer: WebGLRenderer;
  /** What is shown, and where the next picture is drawn meanwhile. */
  private readonly targets = [newTarget(), newTarget()];
  private readonly scene = new Scene();
  private readonly camera = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
  private readonly eyeDome: ShaderMaterial;

  constructor(private readonly canvas: HTMLCanvasElement) {
    this.renderer = new WebGLRenderer({ canvas, antialias: false, preserveDrawingBuffer: true });
    this.renderer.autoClear = false;
    this.eyeDome = new ShaderMaterial({
      vertexShader: SCREEN_VERTEX,
      fragmentShader: EYE_DOME_FRAGMENT,
      depthTest: false,
      depthWrite: false,
      uniforms: {
        colours: { value: null },
        depths: { value: null },
        pixel: { value: new Vector2() },
        near: { value: 1 },
        far: { value: 1 },
        strength: { value: EYE_DOME },
        rings: { value: RINGS },
        background: { value: new Color() },
      },
    });
    this.scene.add(new Mesh(new PlaneGeometry(2, 2), this.eyeDome));
  }

  get context(): WebGL2RenderingContext {
    return this.renderer.getContext() as WebGL2RenderingContext;
  }

  get size(): { width: number; height: number } {
    return { width: this.canvas.clientWidth || 1, height: this.canvas.clientHeight || 1 };
  }

  /** Pixels of the canvas per pixel of the page. */
  get pixelRatio(): number {
    return this.renderer.getPixelRatio();
  }

  /** Takes over the size that the page gives the canvas. */
  resize(): void {
    const { width, height } = this.size;
    const ratio = Math.min(window.devicePixelRatio, 2);
    this.renderer.setPixelRatio(ratio);
    this.renderer.setSize(width, height, false);
    for (const target of this.targets) target.setSize(width * ratio, height * ratio);
    this.eyeDome.uniforms.pixel.value.set(1 / width, 1 / height);
  }

  setBackground(css: string): void {
    // Colours are drawn as they are, without conversion.
    const [r, g, b] = (css.match(/\d+(\.\d+)?/g) ?? ["255", "255", "255"]).map(Number);
    this.eyeDome.uniforms.background.value.setRGB(r / 255, g / 255, b / 255);
  }

  setEyeDome(on: boolean): void {
    this.eyeDome.uniforms.strength.value = on ? EYE_DOME : 0;
  }

  /** Begins the next picture. */
  begin(): void {
    this.renderer.setRenderTarget(this.targets[1]);
    this.renderer.clear();
  }

  /** Draws into the picture that was begun. */
  draw(scene: Scene, camera: Camera): void {
    this.renderer.setRenderTarget(this.targets[1]);
    this.renderer.render(scene, camera);
  }

  /** Shows the picture that was drawn; lit more coarsely where more of it will follow. */
  show({ near, far }: PerspectiveCamera, isWhole: boolean): void {
    this.targets.reverse();
    const [{ texture, depthTexture }] = this.targets;
    const { uniforms } = this.eyeDome;
    uniforms.colours.value = texture;
    uniforms.depths.value = depthTexture;
    uniforms.near.value = near;
    uniforms.far.value = far;
    uniforms.rings.value = uniforms.strength.value === 0 ? 0 : isWhole ? RINGS : FEW_RINGS;
    this.renderer.setRenderTarget(null);
    this.renderer.render(this.scene, this.camera);
  }

  /** What is shown, as a PNG file. */
  picture(): Promise<Blob> {
    return new Promise((resolve, reject) => {
      this.canvas.toBlob(
        (blob) => (blob === null ? reject(new Error("no picture")) : resolve(blob)),
        "image/png",
      );
    });
  }
}

function newTarget(): WebGLRenderTarget {
  const target = new WebGLRenderTarget(1, 1, { minFilter: NearestFilter, magFilter: NearestFilter });
  target.depthTexture = new DepthTexture(1, 1, UnsignedIntType);
  return target;
}
