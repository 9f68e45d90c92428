// What holds on all pages. The script is run again with each page, but takes effect only once.
(() => {
  const OPENED = 'openedAgain', PAUSE = 10000;
  if (window[OPENED]) return;
  window[OPENED] = true;

  // The address contains every change of the study, but “Back” leads to the previous page.
  const push = history.pushState.bind(history);
  history.pushState = (state, title, url) => {
    const stays = new URL(url ?? '', location.href).pathname === location.pathname;
    return stays ? history.replaceState(state, title, url) : push(state, title, url);
  };

  // A link within a page scrolls without changing the address. Otherwise, Streamlit would add the address to
  // the history and draw the page again.
  document.addEventListener('click', (event) => {
    const link = event.target.closest?.('a[href^="#"]');
    const part = link && document.getElementById(link.hash.slice(1));
    if (!part) return;
    event.preventDefault();
    part.scrollIntoView();
  });

  // The client of Streamlit removes the whole page if it gets an element whose predecessors are lost ("Bad delta
  // path"). The address contains the study, so the page is opened again, but not twice within some seconds.
  window.addEventListener('error', ({ message }) => {
    if (!message.includes('delta path') || Date.now() - sessionStorage.getItem(OPENED) < PAUSE) return;
    sessionStorage.setItem(OPENED, Date.now());
    location.reload();
  });
})();
