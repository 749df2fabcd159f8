// Runs in a page under test before its own scripts: collects errors and warnings.
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
