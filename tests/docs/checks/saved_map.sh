# After the README's three runs: the map of the first and its continuation are there.
[ -s streets.map ]
[ -s more.map ]
