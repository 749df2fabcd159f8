import {ChartGroup} from './charts.js';
import {el} from './dom.js';
import {fixed, metres, number, seconds} from './format.js';
import {pageHead, pathView} from './parts.js';

const kColours = ['blue', 'orange', 'green', 'pink', 'violet', 'ochre', 'red', 'slate'];
const kDashes = [undefined, [7, 4], [2, 3]];

/// The page of several runs.
export function showComparison(data, page) {
  document.title = `stereo_slam: ${data.title}`;
  page.append(pageHead(data));
  const runs = data.runs.map((run, i) => ({...run, colour: kColours[i % kColours.length], dash: kDashes[Math.floor(i / kColours.length) % 3]}));
  page.append(runTable(data, runs));
  const times = unionOf(runs.map((run) => run.time_s));
  const left = el('div', {class: 'left'});
  const right = el('div', {class: 'right'});
  page.append(el('main', {}, left, right));
  const scene = sceneOf(data, runs);
  const view = pathView(left, scene, (path, row) => setRow(rowAt(times, scene.paths[path].time_s[row])));
  const charts = new ChartGroup(right, times, setRow);
  for (const chart of chartsOf(data, runs, times)) charts.add(chart);
  page.append(settingsTable(data, runs), el('footer', {}, `Written by stereo_slam ${data.version}. Times are those since the first frame of each run.`));

  let shown = -1;
  function setRow(row) {
    if (row === shown || times.length === 0) return;
    shown = row;
    charts.setRow(row);
    view.setCursor(scene.paths.map((path) => (path.time_s?.length > 0 ? rowAt(path.time_s, times[row]) : null)));
  }
  setRow(times.length - 1);
}

/// All times, in order, each once.
function unionOf(lists) {
  return [...new Set(lists.flat())].sort((a, b) => a - b);
}

/// Index of the time nearest to `time_s`.
function rowAt(times, time_s) {
  let low = 0;
  let high = times.length - 1;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (times[middle] < time_s) low = middle + 1;
    else high = middle;
  }
  return low > 0 && time_s - times[low - 1] < times[low] - time_s ? low - 1 : low;
}

function sceneOf(data, runs) {
  const paths = runs.map((run) => ({name: run.name, layer: run.id, colour: run.colour, dashed: run.dash != null, positions: run.position_m,
    time_s: run.time_s, width: 2.6, pickable: true, order: 2}));
  const legend = runs.map((run) => ({layer: run.id, sign: run.dash ? 'dashed' : 'line', colour: run.colour, text: run.name}));
  if (data.truth_position_m.length > 0) {
    paths.push({name: 'ground truth', layer: 'truth', colour: 'ink', positions: data.truth_position_m, width: 1.6});
    legend.push({layer: 'truth', sign: 'line', colour: 'ink', text: 'ground truth'});
  }
  return {paths, legend};
}

function chartsOf(data, runs, times) {
  const row = new Map(times.map((time, k) => [time, k]));
  const over = (run, values) => {
    const spread = new Array(times.length).fill(null);
    run.time_s.forEach((time, k) => { spread[row.get(time)] = values[k]; });
    return spread;
  };
  const chart = (title, unit, name, more = {}) => ({title, unit, spanGaps: true, ...more,
    series: runs.map((run) => ({name: run.name, values: over(run, run[name]), colour: run.colour, dash: run.dash, digits: more.digits}))});
  const errors = data.has_truth ? [chart('Position error', 'm', 'error_m', {note: 'Distance from the ground truth, with each path aligned at its first common frame.'})] : [];
  return [...errors,
    chart('Position, 1 sigma', 'm', 'sigma_m', {note: 'Root of the trace of the final position’s covariance.'}),
    chart('Time per frame', 'ms', 'total_ms', {digits: 1}),
    chart('Innovation', 'NIS per degree of freedom', 'nis_per_dof', {level: {value: 1, name: 'expected'}}),
    chart('Memory', 'MB', 'resident_mb', {from_zero: false, digits: 0})];
}

/// One row a run. The best value of a column is bold where smaller is better and the runs are of one recording.
function runTable(data, runs) {
  const columns = [
    ['State', (run) => run.state, null],
    ['Frames', (run) => run.frame_count, null],
    ['Lost', (run) => run.lost, null],
    ['Length', (run) => run.length_m, metres],
    ['Loops', (run) => run.loops, null],
    ...(data.has_truth ? [
      ['ATE, m', (run) => run.scores?.ate_m, number, 'least'],
      ['t_rel, %', (run) => run.scores?.t_rel_percent, number, 'least'],
      ['r_rel, °/100 m', (run) => run.scores?.r_rel_deg_per_100m, number, 'least'],
      ['t_rel 10–50 m, %', (run) => run.scores?.t_rel_short_percent, number, 'least'],
      ['RPE 10 m, m', (run) => run.scores?.rpe_10m_m, number, 'least'],
    ] : []),
    ['Median, ms', (run) => run.median_ms, (value) => fixed(value, 1), 'least'],
    ['95 %, ms', (run) => run.p95_ms, (value) => fixed(value, 1), 'least'],
    ['Total', (run) => run.seconds, seconds],
    ['Memory, MB', (run) => run.peak_mb, (value) => fixed(value, 0), 'least'],
  ];
  const best = columns.map(([, value, , rule]) => (rule && data.same_recording ? Math.min(...runs.map((run) => value(run) ?? Infinity)) : null));
  const rows = runs.map((run) => el('tr', {}, el('th', {scope: 'row', style: `--c: var(--${run.colour})`}, el('i', {class: run.dash ? 'dashed' : 'line'}), run.name,
    data.same_recording ? null : el('small', {}, run.dataset)), columns.map(([, value, text], i) => {
    const shown = value(run);
    const cell = text ? text(shown) : String(shown ?? '–');
    return el('td', {class: runs.length > 1 && best[i] != null && shown === best[i] ? 'best' : null}, cell);
  })));
  const problems = runs.filter((run) => run.problem).map((run) => el('p', {class: 'message'}, `${run.name}: ${run.problem}`));
  return el('section', {class: 'card'}, el('div', {class: 'scroll wide'}, el('table', {class: 'runs'},
    el('thead', {}, el('tr', {}, el('th', {}, 'Run'), columns.map(([name]) => el('th', {}, name)))), el('tbody', {}, rows))), problems,
    data.has_truth ? el('p', {class: 'note'}, 'ATE: root mean square of the position error after alignment (SE(3)). t_rel, r_rel: the KITTI score, over segments of 100 to 800 m. ' +
      'RPE: over 10 m.') : null,
    data.same_recording ? null : el('p', {class: 'note'}, 'The runs are of different recordings: their paths all begin at the origin.'));
}

function settingsTable(data, runs) {
  const section = el('section', {class: 'card'}, el('h3', {}, 'Settings and surroundings that differ'));
  if (data.differences.length === 0) {
    section.append(el('p', {class: 'empty'}, runs.length > 1 ? 'None.' : 'There is one run only.'));
    return section;
  }
  const rows = data.differences.map(({key, values}) => el('tr', {}, el('th', {scope: 'row'}, key), values.map((value) => el('td', {}, value))));
  section.append(el('div', {class: 'scroll wide'}, el('table', {class: 'settings'},
    el('thead', {}, el('tr', {}, el('th', {}, ''), runs.map((run) => el('th', {}, run.name)))), el('tbody', {}, rows))));
  return section;
}
