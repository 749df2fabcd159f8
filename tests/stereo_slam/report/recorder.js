// Runs in a page under test before its own scripts: collects errors and warnings, and drives its drawing.
window.pageErrors = [];
addEventListener('error', (event) => window.pageErrors.push(`error: ${event.message}`));
addEventListener('unhandledrejection', (event) => window.pageErrors.push(`unhandled rejection: ${event.reason}`));
for (const name of ['error', 'warn']) {
  const original = console[name];
  console[name] = (...parts) => {
    window.pageErrors.push(`console.${name}: ${parts.join(' ')}`);
    original(...parts);
  };
}
// A browser without a screen draws no frames when nothing asks it to; here they come with the clock.
window.requestAnimationFrame = (callback) => setTimeout(() => callback(performance.now()), 16);
