### Words of the app: its first page, its end.

app-end = End
app-ended = The program has ended. This page can be closed.
app-no_token = This page opens only at the address that the program has printed, with its token. Start thermaxis app anew if the address is lost.
