// Streamlit calls a part of a page each time it is to be drawn, and ends the last call when the part is
// removed. Calls from before the module of the part is loaded are made in any order, as browsers resolve
// imports of one module in any order; all but the newest are then ended at once. So an older call may draw
// last; when it is ended, the newest call draws again. This code comes before all other modules.
const LATE = 8; // maximum number of calls before a module is loaded
const parts = new WeakMap();
const drawers = new WeakMap();

// Return the object that draws into an element; the first call creates it.
function drawerOf(root, Drawer) {
  if (!drawers.has(root)) drawers.set(root, new Drawer(root));
  return drawers.get(root);
}

// Return the entry point of a part. `draw` draws the content of a call and returns a function that stops the
// drawing; if the earlier drawing takes over the new content, it returns the earlier function.
function inOrder(draw) {
  return (call) => {
    const parent = call.parentElement;
    const part = parts.get(parent) ?? { calls: [], stop: null };
    parts.set(parent, part);
    const show = (shown) => {
      const stop = draw(shown);
      if (stop !== part.stop) part.stop?.();
      part.stop = stop;
    };
    part.calls = [...part.calls.slice(-LATE), call];
    show(call);
    return () => {
      const drew = part.calls.at(-1) === call;
      part.calls = part.calls.filter((other) => other !== call);
      if (!drew) return;
      if (part.calls.length && parent.isConnected) return show(part.calls.at(-1));
      part.stop?.();
      part.stop = null;
    };
  };
}
