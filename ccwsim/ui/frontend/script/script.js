// Small scripts that act on the whole page and draw nothing. A script may return a function that ends it.
const SCRIPTS = { arrows, column, cookie, fold, steady, theme, undo };
// elements that use arrow keys
const OWN = 'input, textarea, select, [role=slider], [role=listbox], [role=tab], [contenteditable]';
const WORKING = '.working';
const PHONE = 768; // greatest width in pixels of a window in which the study column covers the page
const REST = 2000; // milliseconds without changes after which a page counts as complete

export default inOrder((component) => SCRIPTS[component.data.script](component));

// Left and right arrow keys step to the next or previous element, except in elements that use these keys.
function arrows({ setTriggerValue }) {
  return hear(document, { keydown: (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step || event.altKey || event.ctrlKey || event.metaKey || event.shiftKey) return;
    if (event.composedPath().some((node) => node.matches && node.matches(OWN))) return;
    event.preventDefault();
    setTriggerValue('told', step);
  } });
}

// Open the column at the left once, because a column that was closed on another page has other controls.
function column({ parentElement }) {
  const { dataset } = parentElement.querySelector('i');
  if (dataset.opened || window.innerWidth <= PHONE) return;
  dataset.opened = true;
  document.querySelector('[data-testid=stExpandSidebarButton] button, button[data-testid=stExpandSidebarButton]')?.click();
}

// Store each cookie that the browser lacks, such as the name of the browser, which survives a reload of the page.
function cookie({ data: { cookies } }) {
  const secure = location.protocol === 'https:' ? '; Secure' : '';
  for (const [name, [value, seconds]] of Object.entries(cookies)) {
    if (document.cookie.split('; ').some((pair) => pair.startsWith(`${name}=`))) continue;
    document.cookie = `${name}=${value}; Path=/; Max-Age=${seconds}; SameSite=Strict${secure}`;
  }
}

// Report a click on a link to a section, and whether the link is the section's title. Other links scroll to the
// section, also after its content has been drawn.
function fold({ setTriggerValue }) {
  const drawn = new ResizeObserver((news) => news.forEach(({ target }) => target.scrollIntoView()));
  const stop = hear(document, {
    click: (event) => {
      const link = event.target.closest?.('a[href^="#"]'), name = link?.hash.slice(1);
      const part = name && document.getElementById(name);
      if (!part) return;
      event.preventDefault();
      drawn.disconnect();
      const isTitle = part.contains(link), section = part.closest('[class*=st-key-section_]');
      if (!isTitle) part.scrollIntoView();
      if (!isTitle && section) drawn.observe(section);
      setTriggerValue('told', [name, isTitle]);
    },
    wheel: () => drawn.disconnect(),
    keydown: () => drawn.disconnect(),
    pointerdown: () => drawn.disconnect(),
  });
  return () => { stop(); drawn.disconnect(); };
}

// While a page is being drawn, parts of the page keep their maximum height, so that elements below do not move.
function steady({ data: { parts } }) {
  const app = document.querySelector('.stApp');
  const watched = new WeakSet();
  const heights = new Map(); // maximum height of each part since the page was complete, by name
  let timer = 0, changed = performance.now();
  const name = (part) => [...part.classList].find((one) => one.startsWith('st-key-'));
  const high = (part) => part.getBoundingClientRect().height;
  const keep = (part) => {
    const least = heights.get(name(part)) || 0;
    if (high(part) >= least) return heights.set(name(part), high(part));
    part.style.minHeight = least + 'px';
    return later();
  };
  const later = () => { timer ||= setTimeout(settle, REST); };
  const settle = () => {
    timer = 0;
    const resting = app.dataset.testScriptState === 'notRunning' && performance.now() - changed > REST;
    if (!resting) later(); // parts may be empty between two runs
    else document.querySelectorAll(parts).forEach((part) => {
      if (part.querySelector(WORKING)) return;
      part.style.minHeight = '';
      heights.set(name(part), high(part));
    });
  };
  const sizes = new ResizeObserver((news) => news.forEach(({ target }) => keep(target)));
  const changes = new MutationObserver((news) => {
    if (news.some(({ type }) => type === 'attributes')) changed = performance.now();
    const drawing = app.dataset.testScriptState !== 'notRunning' || performance.now() - changed < REST;
    document.querySelectorAll(parts).forEach((part) => {
      if (!watched.has(part)) sizes.observe(part); // the observer fixes the height before the part is painted
      else if (!drawing) return;
      watched.add(part);
      keep(part); // before other code reads the height
      later();
    });
  });
  changes.observe(app, { attributeFilter: ['data-test-script-state'], childList: true, subtree: true });
  return () => { sizes.disconnect(); changes.disconnect(); clearTimeout(timer); };
}

// Redraw the page when the user switches between light and dark, because charts keep the colours of the theme in
// which they were drawn.
function theme({ data, parentElement, setTriggerValue }) {
  let asked = data.theme;
  const look = () => {
    const app = document.querySelector('.stApp');
    const now = app && getComputedStyle(app).colorScheme === 'dark' ? 'dark' : 'light';
    // colours in CSS change at once; colours of charts change when the page is redrawn
    document.documentElement.style.colorScheme = now;
    if (now === asked) return;
    asked = now;
    setTriggerValue('told', now);
  };
  look();
  return hear(parentElement.querySelector('i'), { transitionend: look });
}

// Ctrl+Z returns to the study before the last change, except while a text is being typed.
function undo({ setTriggerValue }) {
  let typing = false;
  return hear(document, {
    input: () => { typing = true; },
    focusout: () => { typing = false; },
    keydown: (event) => {
      if (event.key === 'Enter') typing = false;
      const isControl = (event.ctrlKey || event.metaKey) && !event.shiftKey && !event.altKey;
      if (!isControl || event.key.toLowerCase() !== 'z' || typing) return;
      event.preventDefault();
      setTriggerValue('told', true);
    },
  });
}
