// Edits of data on a canvas. Edits wait in a queue until the page has applied them, so that no edit is lost
// or applied twice. This code precedes the modules of editors.
const AGAIN = 2000; // milliseconds after which unapplied edits are sent again

class EditQueue {
  // A new canvas sends the edits that the previous canvas could not send.
  constructor(waiting = []) {
    this.edits = waiting.filter((edit) => edit.seq > Date.now() - 30 * AGAIN);
    this.last = this.ack = 0;
  }

  // Remove the edits that the page has applied, up to a number.
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

  // A page that is being drawn may miss an edit, so edits are sent again; each edit has a number.
  insist() {
    this.rest();
    if (this.edits.length) this.timer = setTimeout(() => this.tell(), AGAIN);
  }

  rest() { clearTimeout(this.timer); }
}

// Return the command (undo or redo) of a key, unless the key is typed into a text field.
function stepOf(event) {
  if (!(event.ctrlKey || event.metaKey) || event.altKey) return null;
  const typing = event.composedPath()[0];
  const text = typing.tagName === 'TEXTAREA' || (typing.tagName === 'INPUT' && typing.type !== 'range');
  if (text || typing.isContentEditable) return null;
  return { z: event.shiftKey ? 'redo' : 'undo', y: 'redo' }[event.key.toLowerCase()] ?? null;
}
