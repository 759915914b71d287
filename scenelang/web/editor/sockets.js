// Websockets that come back by themselves, and JSON-RPC over one.

const FIRST_MS = 300;
const LAST_MS = 5000;
const PATIENCE_MS = 10000;

/**
 * A websocket that is opened again when it is lost.
 * @param {string} address
 * @param {{onopen?: () => void, onclose?: () => void, onmessage: (data: object) => void}} on
 * @returns {{send: (data: object) => boolean, close: () => void}} `send` says whether it could
 */
export function connect(address, { onopen, onclose, onmessage }) {
  let socket = null;
  let wait = FIRST_MS;
  let closed = false;
  const open = () => {
    if (closed) return;
    socket = new WebSocket(address);
    socket.onopen = () => {
      wait = FIRST_MS;
      onopen?.();
    };
    socket.onmessage = ({ data }) => onmessage(JSON.parse(data));
    socket.onclose = () => {
      onclose?.();
      setTimeout(open, wait);
      wait = Math.min(2 * wait, LAST_MS);
    };
  };
  open();
  return {
    send(data) {
      if (socket?.readyState !== WebSocket.OPEN) return false;
      socket.send(JSON.stringify(data));
      return true;
    },
    close() {
      closed = true;
      socket?.close();
    },
  };
}

/**
 * A JSON-RPC peer.
 * @param {(message: object) => boolean} send
 * @param {Object<string, (params: any) => void>} notified what to do about which notification
 */
export function rpc(send, notified) {
  let last = 0;
  const waiting = new Map();  // id -> {resolve, reject}
  const settle = (id, how, value) => {
    const entry = waiting.get(id);
    waiting.delete(id);
    if (entry) clearTimeout(entry.timer);
    entry?.[how](value);
  };
  return {
    /** The answer's result; rejects where it is an error, where none comes, or the line is down. */
    request(method, params) {
      const id = (last += 1);
      return new Promise((resolve, reject) => {
        const timer = setTimeout(() => settle(id, "reject", new Error(`no answer to ${method}`)), PATIENCE_MS);
        waiting.set(id, { resolve, reject, timer });
        if (!send({ jsonrpc: "2.0", id, method, params })) settle(id, "reject", new Error("not connected"));
      });
    },
    notify: (method, params) => send({ jsonrpc: "2.0", method, params }),
    receive(message) {
      if (message.method === undefined) {
        if (message.error) settle(message.id, "reject", new Error(message.error.message));
        else settle(message.id, "resolve", message.result);
      } else if (message.id !== undefined) {
        send({ jsonrpc: "2.0", id: message.id, result: null });  // what a server asks may be left undone
      } else {
        notified[message.method]?.(message.params);
      }
    },
    /** Give up on all that is waited for. */
    lost() {
      for (const id of [...waiting.keys()]) settle(id, "reject", new Error("the connection was lost"));
    },
  };
}
