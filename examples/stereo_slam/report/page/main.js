import {showRun} from './run.js';
import {showComparison} from './compare.js';

/// Builds the page of a run or of a comparison.
export function show(data, page) {
  (data.kind === 'comparison' ? showComparison : showRun)(data, page);
  document.documentElement.dataset.ready = 'yes';
}
