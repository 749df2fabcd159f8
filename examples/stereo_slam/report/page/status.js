/// How the page shows each tracking status. `row` is its place in the chart of the status, `mark` its sign in the view:
/// a status is never shown by its colour alone.
export const kStatuses = [
  {name: 'INITIALIZING', text: 'initialising', colour: 'slate', mark: '', row: 2, width: 2.5,
    meaning: 'no map yet, or the frame that starts it'},
  {name: 'OK', text: 'tracked', colour: 'blue', mark: '', row: 4, width: 3,
    meaning: 'updated by landmarks, or by odometry if no more is asked for'},
  {name: 'WEAK', text: 'weak', colour: 'orange', mark: '!', row: 1, width: 5,
    meaning: 'odometry, the left image or few landmarks only, or position in the map uncertain'},
  {name: 'LOST', text: 'lost', colour: 'red', mark: '×', row: 0, width: 5, dashed: true,
    meaning: 'predicted only; the covariance grows'},
  {name: 'RELOCALISED', text: 'relocalised', colour: 'ochre', mark: '◇', row: 3, width: 5,
    meaning: 'first frame after a loss whose place is known again'},
];

/// Names of the rows of the status chart, from below.
export const kStatusRows = kStatuses.slice().sort((a, b) => a.row - b.row).map((status) => status.text);

/// Why a frame is weak or lost, in plain words; empty for other frames.
export function reasonTexts({frames, reasons}, row) {
  const {name} = kStatuses[frames.status[row]];
  const noticed = reasons.filter((_, bit) => frames.reasons[row] >> bit & 1).map((reason) => reason.text);
  if (name === 'LOST') return ['nothing measured the pose', ...noticed];
  return name === 'WEAK' ? noticed : [];
}
