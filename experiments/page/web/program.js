// The program behind a live page: what it has said so far, and what it is asked to do. What a message holds is in
// experiments/studies/live/live_board.h.

const kAgain_ms = 5000; // a tunnel may come back

export class Program {
  /** onNews({trial, rows, ...}, picture {frame, left, right} or null) may take its time: the program waits. */
  constructor(onNews) {
    this.onNews = onNews;
    this.isOpen = false;
    this.status = {};
    this.work = Promise.resolve();
    this.begin(null);
    this.connect();
  }

  /** Another trial: what happened before belongs to the last one. */
  begin(trial) {
    Object.assign(this, {trial, transitions: [], changes: []});
  }

  connect() {
    const address = new URL('live', location.href);
    address.protocol = address.protocol.replace('http', 'ws');
    const socket = (this.socket = new WebSocket(address));
    socket.binaryType = 'arraybuffer';
    const opened = isOpen => {
      this.isOpen = isOpen;
      this.onNews({isOpen}, null);
    };
    socket.onopen = () => opened(true);
    socket.onmessage = ({data}) => {
      this.work = this.work
        .then(() => this.take(socket, data))
        .catch(error => console.error(error));
    };
    socket.onclose = () => {
      opened(false);
      setTimeout(() => this.connect(), kAgain_ms);
    };
  }

  async take(socket, data) {
    const length = new DataView(data).getUint32(0, true);
    const news = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length)));
    if (news.trial) this.begin(news.trial);
    this.transitions.push(...(news.transitions || []));
    this.changes.push(...(news.changes || []));
    if (news.status) this.status = news.status;
    await this.onNews(news, news.pictures ? pictureIn(news.pictures, data, 4 + length) : null);
    if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify({do: 'got', n: news.n}));
  }

  send(command) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }
}

function pictureIn({frame, left, right}, data, begin) {
  const file = (from, size) => new Blob([new Uint8Array(data, from, size)], {type: 'image/jpeg'});
  return {frame, left: file(begin, left), right: file(begin + left, right)};
}
