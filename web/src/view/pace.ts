/** How many points are drawn at a time, so that the view answers at once on a slow graphics processor or on none. */

/** Points drawn at a time, at first; then as many as take about a frame. */
const START = 100_000;
const LEAST = 60_000;
/** Most points of a picture, however fast they are drawn. */
export const MOST = 6_000_000;
/** Milliseconds of drawing above which fewer points are drawn at a time, and below which more. */
const [SLOW, FAST] = [40, 18];
/** The least and the largest change from one time to the next. */
const [SHRINK, GROW] = [0.3, 1.5];
/** Milliseconds between two looks at whether the graphics processor is done. */
const INTERVAL = 2;

export class Pace {
  /** Points to draw at a time. */
  budget = START;
  private drawing = false;

  constructor(private readonly gl: WebGL2RenderingContext) {}

  /** Whether something is still being drawn: what is handed over now would only wait. */
  get busy(): boolean {
    return this.drawing;
  }

  /** Waits until the points that were handed over are drawn, and takes the budget from how long that was. */
  follow(points: number, begun: number, drawn: () => void): void {
    const { gl } = this;
    const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    this.drawing = true;
    const look = (): void => {
      if (fence !== null && gl.clientWaitSync(fence, 0, 0) === gl.TIMEOUT_EXPIRED) {
        setTimeout(look, INTERVAL);
        return;
      }
      gl.deleteSync(fence);
      this.drawing = false;
      this.adapt(points, performance.now() - begun);
      drawn();
    };
    setTimeout(look, INTERVAL);
  }

  private adapt(points: number, took: number): void {
    if (took > SLOW && points > LEAST) {
      const factor = Math.max(SHRINK, SLOW / took);
      this.budget = Math.max(LEAST, factor * Math.min(points, this.budget));
    } else if (took < FAST) this.budget = Math.min(MOST, GROW * this.budget);
  }
}
