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

// The latest drawing or choice on a canvas. A page that is being drawn may miss it, so it is sent again, at most
// `tries` times, until the page has applied it.
class LatestChoice {
  sent = null; // not applied yet

  constructor(tries) { this.tries = tries; }

  tell(choice) {
    this.sent = choice;
    this.send(choice);
    this.insist();
  }

  insist(tries = this.tries) {
    this.rest();
    this.timer = setTimeout(() => {
      if (this.sent && tries) this.send(this.sent);
      if (this.sent && tries) this.insist(tries - 1);
      else this.sent = null;
    }, AGAIN);
  }

  // Return whether the page has now applied the choice.
  taken(given) {
    const taken = Boolean(this.sent) && isSame(given, this.sent);
    if (taken) this.sent = null;
    return taken;
  }

  rest() { clearTimeout(this.timer); }
}

function isSame(one, other) { return JSON.stringify(one) === JSON.stringify(other); }

// Return the command (undo or redo) of a key, unless the key is typed into a text field.
function stepOf(event) {
  if (!(event.ctrlKey || event.metaKey) || event.altKey) return null;
  const typing = event.composedPath()[0];
  const text = typing.tagName === 'TEXTAREA' || (typing.tagName === 'INPUT' && typing.type !== 'range');
  if (text || typing.isContentEditable) return null;
  return { z: event.shiftKey ? 'redo' : 'undo', y: 'redo' }[event.key.toLowerCase()] ?? null;
}
