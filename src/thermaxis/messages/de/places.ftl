place-file = { $file }
place-line = Zeile { $line }
place-column = Spalte { $column }
place-cell = Zelle { $cell }
place-row = Zeile { $row }
place-key = { $key }
place-channel = { $channel }
