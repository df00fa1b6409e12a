place-file = { $file }
place-line = řádek { $line }
place-column = sloupec { $column }
place-cell = buňka { $cell }
place-row = řádek { $row }
place-key = { $key }
place-channel = { $channel }
