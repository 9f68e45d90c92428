// Stores a name of the browser in a cookie, if there is none, so that the name survives a reload of the page.
export default inOrder(({ data }) => {
  if (document.cookie.split('; ').some((pair) => pair.startsWith(`${data.name}=`))) return;
  const secure = location.protocol === 'https:' ? '; Secure' : '';
  document.cookie = `${data.name}=${data.value}; Path=/; Max-Age=86400; SameSite=Strict${secure}`;
});
