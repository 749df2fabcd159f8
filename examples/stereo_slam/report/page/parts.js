import {el} from './dom.js';
import {TopView} from './top_view.js';
import {View3d} from './view3d.js';

/// The title of a page, and the error of a run that failed.
export function pageHead(data) {
  return el('header', {}, el('h1', {}, data.title), el('p', {class: 'path'}, data.subtitle),
    data.error ? el('p', {class: 'message failed'}, data.error) : null);
}

/// The view of a scene, with its buttons and a legend that shows and hides its layers.
export function pathView(parent, scene, onPick) {
  const frame = el('div', {class: 'view'});
  const section = el('section', {class: 'card view-card'}, frame);
  parent.append(section);
  const view = makeView(frame, scene, onPick);
  const button = (name, text, title) => el('button', {type: 'button', title, onclick: () => view.look(name)}, text);
  const three = view instanceof View3d;
  frame.append(
    el('div', {class: 'view-buttons'}, three ? [button('home', 'Overview', 'The whole path, from above and aside'), button('top', 'Top', 'From above'),
      button('side', 'Side', 'From the left')] : []),
    el('p', {class: 'view-scale'}, `grid ${view.gridText()}`),
    el('p', {class: 'view-hint'}, three ? 'drag to turn, wheel or pinch to zoom, right button or two fingers to move' : 'from above: this browser has no WebGL'));
  section.append(legend(scene, view));
  return view;
}

function makeView(frame, scene, onPick) {
  const hasWebGl = document.createElement('canvas').getContext('webgl2') != null;
  return hasWebGl ? new View3d(frame, scene, onPick) : new TopView(frame, scene, onPick);
}

/// One line a layer: {layer, sign, colour, text}. Those with a `layer` can be switched off.
function legend(scene, view) {
  return el('ul', {class: 'legend'}, scene.legend.map((entry) => {
    const sign = el('i', {class: entry.sign, style: `--c: var(--${entry.colour})`});
    if (!entry.layer) return el('li', {}, sign, entry.text);
    const box = el('input', {type: 'checkbox', checked: true, onchange: () => view.setLayer(entry.layer, box.checked)});
    return el('li', {}, el('label', {}, box, sign, entry.text));
  }));
}
