// In which order a part of a page is drawn. Streamlit calls it for all that is to be drawn, and ends no
// call but the last, where the part goes; but those that come before its module is loaded it calls in
// any order, as browsers resolve imports so, and ends all but the newest at once. An older one may
// then have drawn last: its end draws the newest again. Goes before all modules.
const LATE = 8; // calls that may come before a module is loaded
const parts = new WeakMap();
const drawers = new WeakMap();

// What draws in an element: made at the first call, and the same at those after it.
function drawerOf(root, Drawer) {
  if (!drawers.has(root)) drawers.set(root, new Drawer(root));
  return drawers.get(root);
}

// Of a function that draws what it is called with, and returns how to stop it: where what it drew
// before goes on with the new content, the same function again.
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
