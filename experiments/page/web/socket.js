// The live page's line to the program: messages with pictures in, commands out.
// What a message holds is in experiments/studies/live/live_board.h.

const kAgain_ms = 5000; // a tunnel may come back

export class Line {
  /** onMessage(head, {left, right}: files or null) may take its time: the program waits for it. */
  constructor({onMessage, onState}) {
    Object.assign(this, {onMessage, onState});
    this.work = Promise.resolve();
    this.open();
  }

  open() {
    const address = new URL('live', location.href);
    address.protocol = address.protocol.replace('http', 'ws');
    const socket = (this.socket = new WebSocket(address));
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => this.onState(true);
    socket.onmessage = ({data}) => {
      this.work = this.work
        .then(() => this.take(socket, data))
        .catch(error => console.error(error));
    };
    socket.onclose = () => {
      this.onState(false);
      setTimeout(() => this.open(), kAgain_ms);
    };
  }

  async take(socket, data) {
    const length = new DataView(data).getUint32(0, true);
    const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    let pictures = null;
    if (head.pictures) {
      const {left, right} = head.pictures;
      const begin = 4 + length;
      const file = (from, size) =>
        new Blob([new Uint8Array(data, from, size)], {type: 'image/jpeg'});
      pictures = {left: file(begin, left), right: file(begin + left, right)};
    }
    await this.onMessage(head, pictures);
    if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({do: 'got', n: head.n}));
  }

  send(command) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }
}
