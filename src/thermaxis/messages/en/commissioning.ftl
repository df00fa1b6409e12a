## Where the offset stands while a step is measured

offset-as_found = the offset stands as it was found
offset-further = the offset stands { SIGNED($by_um, decimals: 2) } um further
offset-as_found_again = the offset stands again as it was found
