// Stores each cookie of which the browser has none, such as a name of the browser that survives a reload of the page.
export default inOrder(({ data }) => {
  const secure = location.protocol === 'https:' ? '; Secure' : '';
  for (const [name, [value, seconds]] of Object.entries(data)) {
    if (document.cookie.split('; ').some((pair) => pair.startsWith(`${name}=`))) continue;
    document.cookie = `${name}=${value}; Path=/; Max-Age=${seconds}; SameSite=Strict${secure}`;
  }
});
