// The part of uPlot that the dashboard uses.
export default class uPlot {
  constructor(options: object, data: number[][], target: HTMLElement);
  setSize(size: { width: number; height: number }): void;
  destroy(): void;
}
