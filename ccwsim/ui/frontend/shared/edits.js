// Drawings, choices and edits on a canvas. A page that is being drawn may miss a message, so the message is sent
// again until the page has applied it. This code precedes the modules of editors.
const AGAIN = 2000, TRIES = 30; // milliseconds after which a message is sent again, and how often

// The latest drawing or choice.
class LatestChoice {
  sent = null; // not applied yet

  constructor(send, tries = TRIES) { Object.assign(this, { send, tries }); }

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

  // Return whether the choice `applied` by the page is the choice that was sent.
  taken(applied) {
    const taken = Boolean(this.sent) && isSame(applied, this.sent);
    if (taken) this.sent = null;
    return taken;
  }

  rest() { clearTimeout(this.timer); }
}

// Edits in a queue, so that no edit is lost or applied twice; each has an increasing number.
class EditQueue extends LatestChoice {
  last = 0;

  // A new canvas sends the edits that the previous canvas could not send.
  constructor(send, waiting = []) {
    super(send, Infinity);
    this.edits = waiting.filter((edit) => edit.seq > Date.now() - 30 * AGAIN);
  }

  get edits() { return this.sent ?? []; }

  set edits(edits) { this.sent = edits.length ? edits : null; }

  // Remove the edits that the page has applied, up to a number.
  taken(ack) {
    this.last = Math.max(this.last, ack);
    this.edits = this.edits.filter((edit) => edit.seq > ack);
    this.insist();
  }

  push(edit) {
    this.last = Math.max(Date.now(), this.last + 1);
    this.tell([...this.edits, { seq: this.last, ...edit }]);
  }
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
