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

// The client of Streamlit removes the whole page if it gets an element whose predecessors are lost ("Bad delta
// path"). The address contains the study, so the page is opened again, but not twice within some seconds.
(() => {
  const KEY = 'openedAgain', PAUSE = 10000;
  if (window[KEY]) return;
  window[KEY] = true;
  window.addEventListener('error', ({ message }) => {
    if (!message.includes('delta path') || Date.now() - sessionStorage.getItem(KEY) < PAUSE) return;
    sessionStorage.setItem(KEY, Date.now());
    location.reload();
  });
})();
