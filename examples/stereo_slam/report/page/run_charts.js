import {kStatuses, kStatusRows} from './status.js';

const kStageColours = ['blue', 'orange', 'green', 'pink', 'violet', 'ochre', 'red', 'slate'];

/// The charts of a run, in the order of the page.
export function runCharts(data) {
  const {frames} = data;
  const row = new Map(frames.index.map((frame, k) => [frame, k]));
  const loops = data.loops.filter((loop) => loop.accepted && row.has(loop.frame)).map((loop) => frames.time_s[row.get(loop.frame)]);
  const marks = {name: 'loop', times: loops};
  return [
    statusChart(frames),
    ...truthCharts(data.truth),
    {title: 'Speed', unit: 'm/s', series: [{name: 'speed', values: frames.speed_mps, colour: 'blue', digits: 2}]},
    {title: 'Position, 1 sigma', unit: 'm', marks,
      note: 'Standard deviation of each final position relative to the first frame, along the camera’s axes. It grows with the path length and the ' +
        'distance from the start, and falls where a loop (a mark at the bottom) connects the path to an earlier place.',
      series: axisSeries(frames.sigma_position_m, ['right', 'down', 'forward'])},
    {title: 'Rotation, 1 sigma', unit: 'degrees', marks,
      note: 'Standard deviation of each final orientation relative to the first frame, about the camera’s axes.',
      series: axisSeries(frames.sigma_rotation_deg, ['pitch', 'yaw', 'roll'])},
    {title: 'Height', unit: 'm above the first camera', from_zero: false,
      note: 'Along the vertical axis of the first camera, with one standard deviation. If the first camera was tilted by one degree, a level road rises or falls by 1.7 m in 100 m.',
      series: [{name: 'height', values: column(frames.position_m, 3, 1).map((y) => (y == null ? null : -y)), colour: 'blue', digits: 2, band: frames.sigma_height_m}]},
    ...inertialCharts(data.inertial),
    {title: 'Innovation', unit: 'NIS per degree of freedom', level: {value: 1, name: 'expected'},
      note: 'Normalised innovation squared: the squared distance of the measured points from their predictions, relative to the assumed noise. ' +
        'It is about 1 (dashed) if the noise is as assumed. Values far above 1 mean moving objects, blur or a wrong calibration.',
      series: [{name: 'pose update', values: frames.nis_per_dof, colour: 'blue'}]},
    {title: 'Features, landmarks, matches',
      note: 'Points that the odometry follows, landmarks that the filter holds, and landmarks matched in the frame. With few matches the pose follows from the odometry alone.',
      series: [['features', 'blue'], ['landmarks', 'orange'], ['matches', 'green']].map(([name, colour]) => ({name, values: frames[name], colour, digits: 0}))},
    {title: 'Time per frame', unit: 'ms', stack: true,
      note: 'Processing time without reading the images. What no stage accounts for is “other”.',
      series: stageSeries(frames)},
    {title: 'Memory', unit: 'MB', from_zero: false, note: 'Physical memory of the program after each frame. It grows with the map and the keyframes.',
      series: [{name: 'resident', values: frames.resident_mb, colour: 'blue', digits: 0}]},
  ];
}

/// Component `i` of vectors of `size` numbers, one after another.
function column(values, size, i) {
  return values.filter((value, k) => k % size === i);
}

function axisSeries(values, names) {
  const colours = ['blue', 'orange', 'green'];
  return names.map((name, i) => ({name, values: column(values, 3, i), colour: colours[i]}));
}

function statusChart(frames) {
  return {title: 'Tracking status', rows: kStatusRows,
    note: kStatuses.map((status) => `${status.text}: ${status.meaning}`).join('. ') + '.',
    series: [{name: 'status', values: frames.status.map((status) => kStatuses[status].row), colour: 'blue', width: 2}]};
}

function truthCharts(truth) {
  if (!truth) return [];
  const charts = [
    {title: 'Position error', unit: 'm', note: 'Distance from the ground truth after alignment of the whole path (SE(3)). Its root mean square is the ATE.',
      series: [{name: 'error', values: truth.error_m, colour: 'red'}]},
    {title: 'Rotation error', unit: 'degrees', note: 'Angle to the orientation of the ground truth, after alignment of all orientations.',
      series: [{name: 'error', values: truth.error_deg, colour: 'red'}]},
  ];
  if (truth.nees.some((value) => value != null)) {
    charts.push({title: 'NEES over ten frames', spanGaps: true, log: true, level: {value: 6, name: 'expected'},
      note: 'Normalised estimation error squared: the squared error of a pose relative to ten frames before, in units of its covariance, with six degrees of freedom. ' +
        'It is 6 (dashed) on average if the covariance is right; 95 % of the values should be below 12.6. The errors of the ground truth itself count, too: ' +
        '“stereo_slam evaluate” can allow for them.',
      series: [{name: 'NEES', values: truth.nees, colour: 'violet'}]});
  }
  return charts;
}

/// What the IMU tells, with bands of two standard deviations.
function inertialCharts(inertial) {
  if (!inertial) return [];
  const twice = (sigmas) => sigmas.map((sigma) => (sigma == null ? null : 2 * sigma));
  const chart = (title, unit, name, digits, note) => ({title, unit, note, from_zero: false,
    series: axisSeries(inertial[name], ['x', 'y', 'z']).map((one, i) => ({...one, digits,
      band: twice(column(inertial[`sigma_${name}`], 3, i))}))});
  return [
    chart('Velocity by the IMU', 'm/s', 'velocity_m_s', 3,
      'Velocity of the IMU in its own axes, with a band of two standard deviations. It begins when the motion has told velocity, gravity and biases.'),
    chart('Axes of the IMU above the horizon', 'degrees', 'elevation_deg', 2,
      'The angle of each axis of the IMU above the horizon, by the direction of gravity, with two standard deviations. Until the IMU turns, the bias of the ' +
      'accelerometer cannot be told from a tilt.'),
    chart('Bias of the gyroscope', 'degrees/s', 'gyroscope_bias_deg_s', 3, 'The reading of the gyroscope at rest, with two standard deviations.'),
    chart('Bias of the accelerometer', 'm/s²', 'accelerometer_bias_m_s2', 3,
      'What the accelerometer reads besides the specific force, with two standard deviations.'),
    {title: 'Delay of the IMU', unit: 'ms', from_zero: false,
      note: 'By how much the stamps of the IMU are later than those of the images, besides what the calibration says, with two standard deviations. ' +
        'Turns and accelerations tell it; at rest nothing does.',
      series: [{name: 'delay', values: inertial.delay_ms, colour: 'violet', digits: 2, band: twice(inertial.sigma_delay_ms)}]},
  ];
}

function stageSeries(frames) {
  const series = frames.stages.map((stage, i) => ({name: stage.name, values: stage.ms, colour: kStageColours[i % kStageColours.length], digits: 2}));
  const rest = frames.total_ms.map((total, k) => Math.max(0, total - series.reduce((sum, stage) => sum + (stage.values[k] ?? 0), 0)));
  return [...series, {name: 'other', values: rest, colour: 'grid', digits: 2}];
}
