## Where something is

place-file = { $file }
place-line = line { $line }
place-column = column { $column }
place-cell = cell { $cell }
place-row = row { $row }
place-key = { $key }
place-channel = { $channel }
