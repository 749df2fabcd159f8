// Makes the modules embedded in this page importable by their file names, then starts the page that the data asks for. A page
// opened from a disk may not import files beside it; each module therefore becomes a blob, and the import map names it.
(() => {
  const imports = {};
  for (const script of document.querySelectorAll('script[data-module]')) {
    // Relative imports, './a.js' or '../lines/a.js', become the bare names of the map.
    const text = script.textContent.replace(/(\bfrom\s*|\bimport\s*)(["'])\.{1,2}\/(?:[\w-]+\/)*/g, '$1$2');
    imports[script.dataset.module] = URL.createObjectURL(new Blob([text], {type: 'text/javascript'}));
  }
  imports['three'] = imports['three.module.min.js'];
  const map = document.createElement('script');
  map.type = 'importmap';
  map.textContent = JSON.stringify({imports});
  document.head.append(map);

  const start = document.createElement('script');
  start.type = 'module';
  start.textContent = `
    import {show} from 'main.js';
    show(JSON.parse(document.getElementById('data').textContent), document.getElementById('page'));`;
  document.body.append(start);
})();
