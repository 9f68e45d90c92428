// Reports the sections whose outlines are in view or almost in view.
const NEAR = 240;
const EVERY = 250;
const AGAIN = 3000;

export default inOrder(({ data, setTriggerValue }) => {
  let told = '';
  let when = 0;
  const look = () => {
    const names = data.unseen.filter(near);
    const now = performance.now();
    if (!names.length || (names.join() === told && now - when < AGAIN)) return;
    told = names.join();
    when = now;
    setTriggerValue('seen', names);
  };
  const timer = setInterval(look, EVERY);
  return () => clearInterval(timer);
});

function near(name) {
  const ghost = document.querySelector(`.st-key-section_${name} .unseen`);
  if (!ghost) return false;
  const box = ghost.getBoundingClientRect();
  return box.top < window.innerHeight + NEAR && box.bottom > -NEAR;
}
