// Edits of data on a canvas. They wait in a queue until the page has applied them, so that no edit is lost or
// applied twice. This code comes before the modules of editors.
const AGAIN = 2000; // milliseconds after which edits that the page has not applied are sent again

class EditQueue {
  // A new canvas sends the edits that the previous canvas could not send.
  constructor(waiting = []) {
    this.edits = waiting.filter((edit) => edit.seq > Date.now() - 30 * AGAIN);
    this.last = this.ack = 0;
  }

  // Drop edits up to a number, which the page has applied.
  taken(ack) {
    this.ack = ack;
    this.edits = this.edits.filter((edit) => edit.seq > ack);
    this.insist();
  }

  push(edit) {
    this.last = Math.max(Date.now(), this.last + 1, this.ack + 1);
    this.edits.push({ seq: this.last, ...edit });
  }

  tell() {
    this.send(this.edits);
    this.insist();
  }

  // A page that is just being drawn may miss an edit, so it is sent again; its number identifies it.
  insist() {
    this.rest();
    if (this.edits.length) this.timer = setTimeout(() => this.tell(), AGAIN);
  }

  rest() { clearTimeout(this.timer); }
}

// Return the command of a key, undo or redo, unless it is typed into a text field.
function stepOf(event) {
  if (!(event.ctrlKey || event.metaKey) || event.altKey) return null;
  const typing = event.composedPath()[0];
  const text = typing.tagName === 'TEXTAREA' || (typing.tagName === 'INPUT' && typing.type !== 'range');
  if (text || typing.isContentEditable) return null;
  return { z: event.shiftKey ? 'redo' : 'undo', y: 'redo' }[event.key.toLowerCase()] ?? null;
}
