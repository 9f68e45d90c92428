// On a narrow screen the menu is one line that scrolls sideways. Scroll the name of the current page into
// view, and again if the width of the menu changes because of a late style, a late font or another screen.
(() => {
  document.leavesMenu?.(); // stop the observers of the previous page
  let timer = 0, watched = null;
  const look = () => {
    const menu = document.querySelector('.st-key-menu');
    const own = menu && menu.querySelectorAll('a')[PLACE];
    clearTimeout(timer);
    if (!own) {
      timer = setTimeout(look, 100);
      return;
    }
    if (own !== watched) { // the element was drawn again
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

// The address contains every change of the study, but “Back” leads to the previous page.
(() => {
  if (history.pushesPages) return;
  history.pushesPages = history.pushState.bind(history);
  history.pushState = (state, title, url) => {
    const stays = new URL(url ?? '', location.href).pathname === location.pathname;
    return stays ? history.replaceState(state, title, url) : history.pushesPages(state, title, url);
  };
})();

// A link within a page scrolls without changing the address. Otherwise, Streamlit would add the address to
// the history and draw the page again.
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
