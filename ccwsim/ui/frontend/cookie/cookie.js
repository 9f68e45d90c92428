// Gives the browser a name that outlives a reload of the page, if it has none.
export default inOrder(({ data }) => {
  if (document.cookie.split('; ').some((pair) => pair.startsWith(`${data.name}=`))) return;
  const secure = location.protocol === 'https:' ? '; Secure' : '';
  document.cookie = `${data.name}=${data.value}; Path=/; Max-Age=86400; SameSite=Strict${secure}`;
});
