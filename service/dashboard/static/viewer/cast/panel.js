// A connection to the bridge of a Looking Glass panel, a program on the machine of the user.
import { answerOf, faultOf, FIRST_NUMBER, INFO, PROTOCOL, requestOf, showOf, WIPE } from "./messages.js";

const PATIENCE_MS = 20_000;

export class Panel {
  // `onClosed` is called when the bridge ends the connection.
  constructor(url, onClosed) {
    this.url = url;
    this.onClosed = onClosed;
    this.number = FIRST_NUMBER;
    this.waiting = new Map(); // number -> {resolve, reject, timer}
  }

  // Throws an error with a reason for the user if there is no bridge, or no panel.
  async open() {
    this.socket = new WebSocket(this.url, [PROTOCOL]);
    this.socket.binaryType = "arraybuffer";
    const where = new URL(this.url).host;
    await new Promise((resolve, reject) => {
      this.socket.onopen = resolve;
      this.socket.onclose = () =>
        reject(new Error(`No bridge of a Looking Glass panel answers at ${where}. Is Looking Glass Bridge running?`));
    });
    this.socket.onmessage = ({ data }) => this.hear(data);
    this.socket.onclose = () => {
      this.end(new Error("The bridge of the panel has ended the connection."));
      this.onClosed();
    };
    await this.ask(INFO);
  }

  async show(layout, bytes) {
    await this.ask(showOf(layout), bytes);
  }

  // The panel shows its own background again.
  async close() {
    if (!this.socket) return;
    this.socket.onclose = null;
    if (this.socket.readyState === WebSocket.OPEN) await this.ask(WIPE).catch(() => {});
    this.socket.close();
    this.end(new Error("The connection was closed."));
  }

  ask(command, bin = null) {
    const number = this.number;
    this.number = number === 0xffffffff ? FIRST_NUMBER : number + 1;
    return new Promise((resolve, reject) => {
      const timer = setTimeout(() => this.end(new Error("The bridge of the panel does not answer.")), PATIENCE_MS);
      this.waiting.set(number, { resolve, reject, timer });
      this.socket.send(requestOf(number, command, bin));
    });
  }

  hear(data) {
    const { number, answer } = answerOf(data);
    const asked = this.waiting.get(number);
    if (!asked) return;
    this.waiting.delete(number);
    clearTimeout(asked.timer);
    const fault = faultOf(answer);
    if (fault) asked.reject(new Error(fault));
    else asked.resolve(answer);
  }

  end(error) {
    for (const { reject, timer } of this.waiting.values()) {
      clearTimeout(timer);
      reject(error);
    }
    this.waiting.clear();
  }
}
