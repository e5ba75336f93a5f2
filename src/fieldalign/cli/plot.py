import click

command = click.Command('plot')
