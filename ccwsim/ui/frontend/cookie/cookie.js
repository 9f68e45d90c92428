// Gives the browser a name that survives a reload of the page, if it has no name yet.
export default inOrder(({ data }) => {
  if (document.cookie.split('; ').some((pair) => pair.startsWith(`${data.name}=`))) return;
  const secure = location.protocol === 'https:' ? '; Secure' : '';
  document.cookie = `${data.name}=${data.value}; Path=/; Max-Age=86400; SameSite=Strict${secure}`;
});
