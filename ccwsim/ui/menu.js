// On a narrow screen the menu is one line that scrolls sideways: bring the page's own name into view, and
// again where its width changes, as by a style or a font that comes late, or by another screen.
(() => {
  document.leavesMenu?.(); // of the page before
  let timer = 0, watched = null;
  const look = () => {
    const menu = document.querySelector('.st-key-menu');
    const own = menu && menu.querySelectorAll('a')[PLACE];
    clearTimeout(timer);
    if (!own) {
      timer = setTimeout(look, 100);
      return;
    }
    if (own !== watched) { // drawn anew
      sizes.disconnect();
      for (const element of [menu, own]) sizes.observe(element);
      watched = own;
    }
    const [row, name] = [menu, own].map((element) => element.getBoundingClientRect());
    menu.scrollLeft += name.x + name.width / 2 - row.x - row.width / 2;
  };
  const sizes = new ResizeObserver(look);
  document.leavesMenu = () => { clearTimeout(timer); sizes.disconnect(); };
  look();
})();

// The address follows every change of the study; Back leads to the page before, not to each of them.
(() => {
  if (history.pushesPages) return;
  history.pushesPages = history.pushState.bind(history);
  history.pushState = (state, title, url) => {
    const stays = new URL(url ?? '', location.href).pathname === location.pathname;
    return stays ? history.replaceState(state, title, url) : history.pushesPages(state, title, url);
  };
})();

// A link within a page scrolls and leaves the address alone: Streamlit would take another address for
// a step in the history and draw the page anew.
(() => {
  if (document.scrollsToParts) return;
  document.scrollsToParts = true;
  document.addEventListener('click', (event) => {
    const link = event.target.closest?.('a[href^="#"]');
    const part = link && document.getElementById(link.hash.slice(1));
    if (!part) return;
    event.preventDefault();
    part.scrollIntoView();
  });
})();
