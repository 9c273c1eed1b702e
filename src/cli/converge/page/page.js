'use strict';
(() => {
  const errors = [];
  addEventListener('error', e => { errors.push(e.message); document.body.dataset.errors = errors.length; });
  const root = document.documentElement.style, at = id => document.getElementById(id);
  const set = (name, value) => root.setProperty(name, value);
  let zoom = 1, x = 0, y = 0, held = null;
  // Offsets are kept as parts of a picture's width and height, so that pictures of any size show the same place.
  const show = () => {
    x = Math.min(0, Math.max(1 - zoom, x)); y = Math.min(0, Math.max(1 - zoom, y));
    set('--zoom', zoom); set('--x', 100 * x + '%'); set('--y', 100 * y + '%');
  };
  const scaleTo = (to, px, py) => {
    to = Math.min(32, Math.max(1, to));
    x = px - (px - x) * to / zoom; y = py - (py - y) * to / zoom; zoom = to; show();
  };
  for (const view of document.querySelectorAll('.view')) {
    const place = e => { const r = view.getBoundingClientRect(); return [(e.clientX - r.left) / r.width, (e.clientY - r.top) / r.height]; };
    view.addEventListener('wheel', e => { e.preventDefault(); scaleTo(zoom * Math.exp(-e.deltaY / 300), ...place(e)); }, { passive: false });
    view.addEventListener('pointerdown', e => { e.preventDefault(); view.setPointerCapture(e.pointerId); held = place(e); });
    view.addEventListener('pointermove', e => { if (held) { const p = place(e); x += p[0] - held[0]; y += p[1] - held[1]; held = p; show(); } });
    view.addEventListener('pointerup', () => { held = null; });
    view.addEventListener('dblclick', () => { zoom = 1; x = y = 0; show(); });
  }
  const slider = at('slider'), a = at('a'), b = at('b');
  slider.addEventListener('input', () => set('--cut', slider.value + '%'));
  const choose = () => { at('top').src = at('image-' + a.value).src; at('under').src = at('image-' + b.value).src; };
  const flip = () => { [a.value, b.value] = [b.value, a.value]; choose(); };
  a.addEventListener('change', choose); b.addEventListener('change', choose);
  at('flip').addEventListener('click', flip);
  at('reset').addEventListener('click', () => { zoom = 1; x = y = 0; show(); });
  addEventListener('keydown', e => { if (e.key === 'f') flip(); });
  choose();
  if (location.hash === '#selftest') addEventListener('load', () => {
    const check = (holds, what) => { if (!holds) throw Error(what); };
    let outcome = 'passed';
    try {
      check([...document.images].every(i => i.complete && i.naturalWidth > 0), 'an image is broken');
      const cut = () => getComputedStyle(at('cut')).clipPath + getComputedStyle(at('bar')).left;
      const before = cut(); slider.value = 80; slider.dispatchEvent(new Event('input')); check(cut() !== before, 'the slider does not move');
      const first = at('top').src; at('flip').click(); check(at('top').src !== first && at('under').src === first, 'flip does nothing');
      const box = () => at('image-0').getBoundingClientRect().width, small = box(); scaleTo(2, .5, .5); check(Math.abs(box() / small - 2) < .01, 'no zoom');
      check(document.querySelectorAll('.plots svg circle').length > 3, 'no plots');
      check(document.querySelectorAll('.plots svg').length === 4, 'not four plots');
      check(document.querySelectorAll('.facts tr').length > 6 && at('data').textContent.includes('processor'), 'no facts');
      check(document.querySelectorAll('.agreement td[class]').length > 2, 'no agreement');
      check(JSON.parse(at('data').textContent).integrators.length > 0, 'no data');
      check(errors.length === 0, errors.join());
    } catch (error) { outcome = 'failed: ' + error.message; }
    document.body.dataset.selftest = outcome;
  });
})();
