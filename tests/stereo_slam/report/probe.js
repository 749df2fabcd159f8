// Runs in a page under test: looks at it and uses it as a reader would, and writes what is wrong into an element at its end.
(async () => {
  const faults = window.pageErrors;  // filled by recorder.js since the page began
  const check = (holds, text) => { if (!holds) faults.push(text); };
  const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
  const all = (selector) => [...document.querySelectorAll(selector)];
  const expected = JSON.parse(document.getElementById('expected').textContent);

  for (let i = 0; i < 100 && !document.documentElement.dataset.ready; ++i) await pause(50);
  check(document.documentElement.dataset.ready === 'yes', 'the page did not start');
  await pause(300);

  /// Number of different colours in a canvas, and its pixels.
  function look(canvas) {
    const copy = document.createElement('canvas');
    copy.width = canvas.width;
    copy.height = canvas.height;
    const context = copy.getContext('2d');
    context.drawImage(canvas, 0, 0);
    const pixels = new Uint32Array(context.getImageData(0, 0, copy.width, copy.height).data.buffer);
    return {pixels, colours: new Set(pixels).size};
  }
  const differ = (a, b) => a.pixels.reduce((count, pixel, i) => count + (pixel !== b.pixels[i]), 0);

  for (const text of expected.texts) check(document.body.innerText.includes(text), `the page does not say “${text}”`);
  check(all('figure.chart').length === expected.charts, `${all('figure.chart').length} charts instead of ${expected.charts}`);
  const outside = performance.getEntriesByType('resource').filter((entry) => !/^(blob|data):/.test(entry.name));
  check(outside.length === 0, `fetched ${outside.map((entry) => entry.name)}`);
  check(document.documentElement.scrollWidth <= innerWidth, `is ${document.documentElement.scrollWidth} px wide in a window of ${innerWidth} px`);
  for (const canvas of all('figure.chart canvas')) check(look(canvas).colours > 5, `the chart ${canvas.closest('figure').querySelector('h3').textContent} is empty`);
  const view = document.querySelector('.view canvas');
  if (expected.view) {
    check(view != null, 'there is no view');
    check(view && look(view).colours > (expected.interactive ? 20 : 2), 'the view is empty');
  } else {
    check(view == null, 'there is a view');
  }
  if (expected.interactive) await use();

  const result = document.createElement('pre');
  result.id = 'result';
  result.textContent = faults.length === 0 ? 'passed' : faults.join('\n');
  document.body.append(result);

  async function use() {
    const legends = () => all('figure.chart').map((figure) => figure.querySelector('.u-legend').innerText);
    const cursors = () => all('.u-cursor-x').map((line) => Math.round(new DOMMatrix(getComputedStyle(line).transform).e / line.parentElement.clientWidth * 100));

    // The pointer over one chart moves the cursor of all.
    const over = all('.u-over')[1];
    const area = over.getBoundingClientRect();
    const before = legends();
    over.dispatchEvent(new MouseEvent('mousemove', {clientX: area.left + 0.3 * area.width, clientY: area.top + 0.5 * area.height, bubbles: true}));
    await pause(200);
    check(legends().filter((legend, i) => legend !== before[i]).length >= 3, 'hovering over a chart changes no values');
    check(new Set(cursors()).size === 1, `the cursors are apart: ${cursors()}`);
    check(Math.abs(cursors()[0] - 30) <= 3, `the cursor is at ${cursors()[0]} % instead of 30 %`);

    const heading = () => document.querySelector('.cursor-card h2')?.textContent ?? legends().join();
    const slider = document.querySelector('.slider input');
    if (slider) {
      check(heading().includes(`Frame ${expected.frame_at_30_percent}`), `${heading()} instead of frame ${expected.frame_at_30_percent}`);
      for (const reason of expected.reasons_at_30_percent)
        check(document.querySelector('.cursor-card').innerText.includes(reason), `the frame at the cursor is lost, but not because “${reason}”`);
      slider.value = 0;
      slider.dispatchEvent(new Event('input'));
      check(heading().startsWith('Frame 0 '), 'the slider does not move the cursor');
      const image = document.querySelector('.thumbnail img');
      await image.decode();
      check(image.naturalWidth > 0, 'there is no image of the frame');
    }

    // Dragging turns the view; wheel zooms; buttons and boxes change it. A made-up pointer cannot be captured.
    view.setPointerCapture = view.releasePointerCapture = () => {};
    const pointer = (name, x, y, buttons) => view.dispatchEvent(
      new PointerEvent(name, {pointerId: 1, pointerType: 'mouse', button: name === 'pointermove' ? -1 : 0, buttons, clientX: x, clientY: y, bubbles: true}));
    const frame = view.getBoundingClientRect();
    const [x, y] = [frame.left + frame.width / 2, frame.top + frame.height / 2];
    let seen = look(view);
    const changed = async (action, what) => {
      action();
      await pause(200);
      const now = look(view);
      check(differ(seen, now) > 500, `${what} does not change the view`);
      seen = now;
    };
    if (expected.turns) await changed(() => {
      pointer('pointerdown', x, y, 1);
      for (let i = 1; i <= 5; ++i) pointer('pointermove', x + 30 * i, y + 10 * i, 1);
      pointer('pointerup', x + 150, y + 50, 0);
    }, 'dragging');
    if (expected.turns) await changed(() => view.dispatchEvent(new WheelEvent('wheel', {deltaY: -300, clientX: x, clientY: y, bubbles: true, cancelable: true})), 'the wheel');
    if (expected.turns) await changed(() => all('.view-buttons button')[1].click(), 'the button Top');
    for (const box of all('.legend input')) box.click();
    await pause(200);
    const hidden = differ(seen, look(view));
    check(hidden > 50, `hiding all layers changes ${hidden} pixels of the view`);
    for (const box of all('.legend input')) box.click();
    await pause(200);

    // The pointer over the path moves the cursor.
    const found = new Set();
    for (let dy = 4; dy < frame.height; dy += 10) {
      for (let dx = 4; dx < frame.width; dx += 10) {
        pointer('pointermove', frame.left + dx, frame.top + dy, 0);
        found.add(heading());
      }
    }
    check(found.size >= 5, 'hovering over the path does not move the cursor');
  }
})();
