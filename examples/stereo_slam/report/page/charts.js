import {colour, el, onThemeChange} from './dom.js';
import {fixed, number} from './format.js';

const kHeight_px = 142;

/// Charts over a common time axis with a common cursor. A chart is
///   {title, unit, note, series: [{name, values, colour, digits, dash, band}], and optionally
///    stack: true (series on top of each other; the first is at the bottom),
///    log: true, level: {value, name}, marks: {name, times}, rows: [names] (categories 0, 1 ... instead of numbers), from_zero: false}
export class ChartGroup {
  /// `onHover(row)` is called when the pointer is over a chart; rows are indices of `time_s`.
  constructor(parent, time_s, onHover) {
    this.parent = parent;
    this.time_s = time_s;
    this.onHover = onHover;
    this.charts = [];
    onThemeChange(() => this.charts.forEach((chart) => chart.plot.redraw(false)));
  }

  add(chart) {
    const head = el('div', {class: 'chart-head'}, el('h3', {}, chart.title, chart.unit ? el('small', {}, ` ${chart.unit}`) : null));
    const note = chart.note ? el('details', {}, el('summary', {'aria-label': `About: ${chart.title}`}, '?'), el('p', {}, chart.note)) : null;
    const figure = el('figure', {class: 'chart'}, head, note);
    this.parent.append(figure);
    const drawn = chart.series.filter((series) => series.values.some((value) => Number.isFinite(value)));
    if (this.time_s.length === 0 || drawn.length === 0) {
      figure.append(el('p', {class: 'empty'}, this.time_s.length === 0 ? 'No frames.' : 'No values.'));
      return;
    }
    const plot = new uPlot(this.options(chart, figure, head), this.dataOf(chart), figure);
    this.charts.push({plot});
    new ResizeObserver(() => {
      const width = widthIn(figure);
      if (width > 0 && width !== plot.width) plot.setSize({width, height: plot.height});
    }).observe(figure);
  }

  /// Values as drawn: of a stack the sums, the highest first, so that the lower ones are painted over it.
  dataOf(chart) {
    const values = chart.series.map((series) => series.values);
    const data = [this.time_s];
    if (chart.stack) {
      const sums = [];
      for (const series of values) sums.push(series.map((value, k) => (value ?? 0) + (sums.length ? sums.at(-1)[k] : 0)));
      data.push(...sums.reverse());
    } else {
      data.push(...values);
    }
    for (const {values: middle, band} of chart.series.filter((one) => one.band)) {
      for (const sign of [1, -1]) data.push(middle.map((value, k) => (value == null || band[k] == null ? null : value + sign * band[k])));
    }
    return data;
  }

  options(chart, figure, head) {
    const series = chart.series.map((one) => this.seriesOf(chart, one));
    if (chart.stack) series.reverse();
    const bands = [];
    for (const one of chart.series.filter((each) => each.band)) {
      const edge = {stroke: 'transparent', points: {show: false}, class: 'hidden'};
      series.push({...edge, label: 'upper'}, {...edge, label: 'lower'});
      bands.push({series: [series.length - 1, series.length], fill: () => `${colour(one.colour)}30`});
    }
    return {
      width: Math.max(widthIn(figure), 200),
      height: kHeight_px,
      series: [{label: 'time', value: (plot, value) => (value == null ? '–' : `${fixed(value, 2)} s`)}, ...series],
      bands,
      scales: {x: {time: false}, y: {distr: chart.log ? 3 : 1, range: (plot, low, high) => (chart.log ? decadesOf(low, high) : this.rangeOf(chart, low, high))}},
      axes: [this.axis({size: 26, space: 64, values: (plot, times) => times.map((time) => `${time} s`)}), this.axis(this.valueAxis(chart))],
      cursor: {
        y: false,
        points: {size: 7},
        drag: {x: true, y: false, setScale: true},
        sync: {key: 'time', setSeries: false, scales: ['x', null]},
        bind: {mouseleave: () => null, dblclick: () => () => this.zoom(null)},
        move: (plot, left, top) => [left, top],
      },
      legend: {live: true, mount: (plot, legend) => head.append(legend)},
      hooks: {
        setCursor: [(plot) => this.follow(plot)],
        setScale: [(plot, key) => key === 'x' && this.zoom(plot)],
        draw: [(plot) => this.drawExtras(plot, chart)],
      },
    };
  }

  seriesOf(chart, series) {
    const tint = () => colour(series.colour);
    const text = (plot, value, index, row) => {
      const own = row == null ? null : series.values[row];
      if (chart.rows) return own == null ? '–' : chart.rows[own];
      return series.digits == null ? number(own) : fixed(own, series.digits);
    };
    return {
      label: series.name,
      stroke: tint,
      fill: chart.stack ? tint : undefined,
      width: chart.stack ? 0.5 : series.width ?? 1.6,
      dash: series.dash,
      value: text,
      spanGaps: chart.spanGaps ?? false,
      points: {show: this.time_s.length === 1, size: 7},
      paths: chart.rows ? uPlot.paths.stepped({align: -1}) : undefined,
    };
  }

  axis(more) {
    const font = '12px system-ui, sans-serif';
    return {stroke: () => colour('muted'), font, grid: {stroke: () => colour('rule'), width: 1}, ticks: {stroke: () => colour('rule'), size: 4},
      gap: 4, ...more};
  }

  valueAxis(chart) {
    if (chart.log) return {size: 54, splits: (plot, axis, low, high) => powersOfTen(low, high), filter: (plot, splits) => splits, values: (plot, powers) => powers.map((power) => number(power, 1))};
    if (!chart.rows) return {size: 54, space: 30};
    return {size: 84, splits: () => chart.rows.map((name, row) => row), values: () => chart.rows};
  }

  rangeOf(chart, low, high) {
    if (chart.rows) return [-0.4, chart.rows.length - 0.6];
    let [least, most] = [low, high];
    if (least == null || most == null) return [0, 1];
    if (chart.level) [least, most] = [Math.min(least, chart.level.value), Math.max(most, chart.level.value)];
    if (chart.from_zero !== false) least = Math.min(least, 0);
    const margin = most > least ? 0.06 * (most - least) : Math.max(0.1 * Math.abs(most), 0.5);
    return [chart.from_zero !== false && least === 0 ? 0 : least - margin, most + margin];
  }

  /// The dashed level and the marks at the bottom.
  drawExtras(plot, chart) {
    const {ctx: context, bbox} = plot;
    context.save();
    context.strokeStyle = colour('ink');
    context.lineWidth = 1.5 * devicePixelRatio;
    context.beginPath();
    for (const time of chart.marks?.times ?? []) {
      const x = plot.valToPos(time, 'x', true);
      if (x < bbox.left || x > bbox.left + bbox.width) continue;
      context.moveTo(x, bbox.top + bbox.height);
      context.lineTo(x, bbox.top + bbox.height - 8 * devicePixelRatio);
    }
    context.stroke();
    if (chart.level) {
      const y = plot.valToPos(chart.level.value, 'y', true);
      context.setLineDash([6, 5]);
      context.beginPath();
      context.moveTo(bbox.left, y);
      context.lineTo(bbox.left + bbox.width, y);
      context.stroke();
    }
    context.restore();
  }

  /// Called when the cursor of a chart has moved. Calls onHover, unless setRow moved the cursor.
  follow(plot) {
    if (this.placing || plot.cursor.idx == null || plot.cursor.left < 0) return;
    this.onHover(plot.cursor.idx);
  }

  /// Places the cursor of every chart.
  setRow(row) {
    this.placing = true;
    for (const {plot} of this.charts) {
      const left = plot.valToPos(this.time_s[row], 'x');
      plot.setCursor({left, top: 0});
      plot.setLegend({idx: row});
    }
    this.placing = false;
  }

  /// All charts show the same times: those of `plot`, or all for null.
  zoom(plot) {
    if (this.zooming) return;
    this.zooming = true;
    const [first, last] = [this.time_s[0], this.time_s.at(-1)];
    const {min, max} = plot ? plot.scales.x : {min: first, max: last};
    for (const other of this.charts) {
      if (other.plot !== plot && max > min) other.plot.setScale('x', {min, max});
    }
    this.zooming = false;
  }
}

/// Width inside the padding of an element.
function widthIn(element) {
  const style = getComputedStyle(element);
  return element.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight);
}

/// The powers of ten around a range of values.
function decadesOf(low, high) {
  if (!(low > 0) || !(high > 0)) return [0.1, 10];
  return [10 ** Math.floor(Math.log10(low)), 10 ** Math.ceil(Math.log10(high * 1.0001))];
}

/// At most six powers of ten in a range that begins and ends with one.
function powersOfTen(low, high) {
  const [first, last] = [Math.round(Math.log10(low)), Math.round(Math.log10(high))];
  const step = Math.ceil((last - first + 1) / 6);
  return Array.from({length: Math.floor((last - first) / step) + 1}, (unused, i) => 10 ** (first + i * step));
}
