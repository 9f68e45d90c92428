// Streamlit calls a component each time it draws the component, and ends the last call when the component is
// removed. Calls before the component's module is loaded run in any order, because browsers resolve imports
// in any order; all calls except the newest are ended at once. So an older call may draw last; when this call
// ends, the newest call draws again. This code precedes all other modules.
const LATE = 8; // maximum number of calls before the module is loaded
const parts = new WeakMap();
const drawers = new WeakMap();

// Return the entry point of a component. `draw` draws the content of a call and returns a function that ends
// the drawing; if the earlier drawing updates to the new content, `draw` returns the earlier function.
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

// Return the entry point of a component that an object draws into an element; the first call creates the object.
function drawnBy(Drawer, selector) {
  return inOrder(({ data, parentElement, setTriggerValue }) => {
    const root = parentElement.querySelector(selector);
    if (!drawers.has(root)) drawers.set(root, new Drawer(root));
    const drawer = drawers.get(root);
    drawer.report = setTriggerValue;
    drawer.show(data);
    return drawer.stop;
  });
}

// Add listeners to an element or window, and return a function that removes them.
function hear(target, listeners) {
  const heard = new AbortController(), { signal } = heard;
  for (const [kind, listener] of Object.entries(listeners)) target.addEventListener(kind, listener, { signal });
  return () => heard.abort();
}

// Return a new element with properties and children.
function element(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

function download(name, href) { element('a', { download: name, href }).click(); }

function clamp(value, low, high) { return Math.min(Math.max(value, low), high); }
