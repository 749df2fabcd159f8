import {ellipsoidScale, extentOf} from './scale.js';
import {kStatuses} from './status.js';

/// What the view of a run shows: its path by status, the map, ellipsoids, loops, the path without loops and the ground truth.
export function runScene(data) {
  const {frames, truth} = data;
  const scale = ellipsoidScale(data.ellipsoids, extentOf(frames.position_m));
  const paths = [{name: 'path', layer: 'path', styles: kStatuses, statuses: frames.status, positions: frames.position_m,
    quaternions: frames.quaternion_xyzw, pickable: true, cursor: true, cursorColour: 'ink', order: 2}];
  if (truth) paths.push({name: 'ground truth', layer: 'truth', colour: 'ink', positions: truth.position_m, width: 1.6, cursor: true});
  if (data.without_loops_m) paths.push({name: 'without loops', layer: 'uncorrected', colour: 'muted', positions: data.without_loops_m, width: 1.5, dashed: true, background: true});
  return {paths, points: data.map, ellipsoids: data.ellipsoids, ellipsoid_scale: scale, links: linksOf(data), legend: legendOf(data, scale)};
}

function linksOf(data) {
  const row = new Map(data.frames.index.map((frame, k) => [frame, k]));
  const nearest = (frame) => row.get(frame) ?? data.frames.index.findIndex((shown) => shown >= frame);
  const place = (k) => data.frames.position_m.slice(3 * k, 3 * k + 3);
  return data.loops.filter((loop) => !loop.in_loaded_map && nearest(loop.frame) >= 0 && nearest(loop.old_frame) >= 0)
    .map((loop) => ({from: place(nearest(loop.frame)), to: place(nearest(loop.old_frame)), accepted: loop.accepted}));
}

function legendOf(data, scale) {
  const entries = [];
  kStatuses.forEach((status, i) => {
    if (data.status_counts[i] === 0 || status.name === 'INITIALIZING') return;
    const sign = status.dashed ? 'dashed' : status.mark ? 'thick' : 'line';
    entries.push({sign, colour: status.colour, text: `${status.mark ? `${status.mark} ` : ''}${status.text}`});
  });
  if (data.truth) entries.push({layer: 'truth', sign: 'line', colour: 'ink', text: 'ground truth'});
  if (data.without_loops_m) entries.push({layer: 'uncorrected', sign: 'dashed', colour: 'muted', text: 'without loop closure'});
  if (data.loop_counts.accepted > 0) entries.push({layer: 'loops', sign: 'line', colour: 'green', text: 'loops'});
  if (data.loop_counts.refused > 0) entries.push({layer: 'refused', sign: 'dashed', colour: 'pink', text: 'refused loops'});
  if (data.ellipsoids.length > 0) {
    entries.push({layer: 'ellipsoids', sign: 'ellipse', colour: 'violet', text: scale > 1 ? `1 sigma, enlarged ${scale} times` : '1 sigma'});
  }
  if (data.map.positions.length > 0) entries.push({layer: 'points', sign: 'dot', colour: 'slate', text: 'map points'});
  return entries;
}
